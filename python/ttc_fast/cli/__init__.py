"""The command ``ttc-fast``: arguments in, exit codes out. Each command is a file of this folder."""

from __future__ import annotations

import argparse
import io
import os
import re
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from ttc_fast import SIMD_LEVEL, __version__
from ttc_fast._exit_codes import DONE, FAILED, INTERRUPTED, MISSING_EXTRA, UNREADABLE
from ttc_fast._extras import EXTRAS, install
from ttc_fast._settings import ON_COMMAND_LINE, hint
from ttc_fast.cli import bench, demo, doctor, node, replay
from ttc_fast.cli.exits import EXIT_CODES, CommandError
from ttc_fast.logs import LogError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

DESCRIPTION = """\
  ttc-fast demo                                  see it work: two simulated drives, tables and pictures
  ttc-fast replay drive.bag --plot drive.png     when would it have braked on a recorded drive, and why?
  ttc-fast replay drives/*.bag --summary all.csv many drives at once, and a table of them
  ttc-fast node --rclpy --config brake.toml      brake on the vehicle, in a graph of ROS
  ttc-fast bench                                 how fast is it on this machine?
  ttc-fast doctor                                does it work on this machine, and what is installed?

Time to collision from laser scans, point clouds and distances.
"""
NUMBER = re.compile(r"-(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$|-(inf|infinity|nan)$", re.IGNORECASE)
"""A negative number, which is no option."""


class Parser(argparse.ArgumentParser):
    """A parser that tells every negative number from an option, and says what a mistyped option may have been."""

    def __init__(self, **settings: Any) -> None:
        how = {"formatter_class": argparse.RawDescriptionHelpFormatter, "epilog": EXIT_CODES, "add_help": False}
        super().__init__(**how, **settings)  # type: ignore[arg-type]
        self._negative_number_matcher = NUMBER
        self.common: tuple[str, ...] | None = None
        """The options of which the short help says the first sentence; None are all."""
        self.add_argument("-h", "--help", action=Help, const=False, help="Print what is used most, and end.")
        self.add_argument("--help-all", action=Help, const=True, help="Print everything, and end.")

    def format_short_help(self) -> str:
        """Return the help on what is used most, which fits a screen."""
        if self.common is None:
            return self.format_help()
        used = [each for each in self._actions if {"--help", *self.common}.intersection(each.option_strings)]
        formatter = self._get_formatter()
        formatter.add_usage(self.usage, self._actions, self._mutually_exclusive_groups)
        formatter.add_text(self.description)
        formatter.start_section("options that are used most")
        whole = [(each, each.help) for each in used]
        for each, text in whole:
            each.help = re.split(r"[.;] ", text or "")[0].removesuffix(".") + "."
        formatter.add_arguments(used)
        formatter.end_section()
        formatter.add_text("--help-all has every option, and the exit codes.")
        short = formatter.format_help()
        for each, text in whole:
            each.help = text
        return short

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if isinstance(action.choices, dict) and value not in action.choices:
            self.error(f"there is no command {value}: {hint(value, action.choices)}")
        super()._check_value(action, value)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse; an option that is unknown ends the command here, where those of its command are known."""
        known, rest = super().parse_known_args(args, namespace)
        unknown = next((each for each in rest if each.startswith("--") and each != "--"), None)
        if unknown is not None:
            flag = unknown.partition("=")[0]
            self.error(f"there is no option {flag}: {hint(flag, self._option_string_actions)}")
        return known, rest


class Help(argparse.Action):
    """Prints the short help, or all of it."""

    def __init__(self, option_strings: Sequence[str], dest: str, const: bool, help: str) -> None:  # noqa: A002
        super().__init__(option_strings, dest=argparse.SUPPRESS, nargs=0, const=const, help=help)

    def __call__(self, parser: Any, *_: Any) -> None:
        """Print, and end the command."""
        print(parser.format_help() if self.const else parser.format_short_help(), end="")
        parser.exit()


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command ``ttc-fast``.

    Parameters
    ----------
    argv : sequence of str, optional
        The arguments; None takes those of the process.

    Returns
    -------
    int
        The exit code, as ``ttc-fast --help`` lists them.

    Raises
    ------
    SystemExit
        By argparse, after ``--help`` or a command line that makes no sense, and by rich, when the output is not read
        any more; with a code of the same list.

    Examples
    --------
    >>> from ttc_fast.cli import main
    >>> main(["replay", "scan.xyz"])  # an error, on standard error
    3
    """
    with any_console():
        return _run(argv)


@contextmanager
def any_console() -> Iterator[None]:
    """Have a console show a question mark for a character that its encoding lacks, instead of ending the command."""
    streams = (each for each in (sys.stdout, sys.stderr) if isinstance(each, io.TextIOWrapper))
    strict = [each for each in streams if each.errors == "strict"]
    for each in strict:
        each.reconfigure(errors="replace")
    try:
        yield
    finally:
        for each in strict:
            if not each.closed:
                each.reconfigure(errors="strict")


def _run(argv: Sequence[str] | None) -> int:
    token = ON_COMMAND_LINE.set(True)
    try:
        parser = parsers()["ttc-fast"]
        if not (sys.argv[1:] if argv is None else argv):
            print(parser.format_help(), end="")
            return DONE
        arguments = parser.parse_args(argv)
        arguments.run(arguments)
        sys.stdout.flush()
    except LogError as error:
        return _complain(UNREADABLE, str(error))
    except CommandError as error:
        return _complain(error.code, str(error))
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in EXTRAS:
            raise
        extra = arguments.extra or EXTRAS[package]
        return _complain(MISSING_EXTRA, f"this needs {package}, which is not installed: {install(extra)}")
    except BrokenPipeError:  # what reads the output has ended, such as `| head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python flushes it once more at its end
        return FAILED
    except OSError as error:  # such as a name that is too long for a file
        where = f"{error.filename}: " if error.filename else ""
        return _complain(FAILED, f"{where}{error.strerror or error}")
    except KeyboardInterrupt:
        return _complain(INTERRUPTED, "interrupted")
    finally:
        ON_COMMAND_LINE.reset(token)
    return DONE


def _complain(code: int, problem: str) -> int:
    print(f"ttc-fast: {problem}", file=sys.stderr)
    return code


def parsers() -> dict[str, argparse.ArgumentParser]:
    """Return the parser of ``ttc-fast`` and that of each of its commands, by what is typed."""
    parser = Parser(prog="ttc-fast", usage="ttc-fast COMMAND [OPTION ...]", description=DESCRIPTION)
    parser.epilog = f"ttc-fast COMMAND --help says more.\n\n{EXIT_CODES}"
    version = f"ttc-fast {__version__}, kernels: {SIMD_LEVEL}"
    parser.add_argument("--version", action="version", version=version, help="Print the version, and end.")
    commands = parser.add_subparsers(metavar="COMMAND", required=True, prog=parser.prog, title="commands")
    each: dict[str, argparse.ArgumentParser] = {parser.prog: parser}
    for name, command in (("replay", replay), ("demo", demo), ("bench", bench), ("node", node), ("doctor", doctor)):
        options = each[f"{parser.prog} {name}"] = commands.add_parser(
            name,
            usage=getattr(command, "USAGE_LINE", None),
            help=command.SUMMARY,
            description=command.DESCRIPTION,
        )
        command.add_options(options)
        options.common = getattr(command, "COMMON", None)
        options.set_defaults(run=command.run, extra=getattr(command, "EXTRA", None))
    return each
