"""The command ``ttc-fast``: arguments in, exit codes out. What it does is in ``demo`` and ``bench``."""

from __future__ import annotations

import argparse
import math
import sys
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ttc_fast import SIMD_LEVEL
from ttc_fast.logs import FORMATS, LogError, Scanner, open_log

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.figure import Figure

T = TypeVar("T", float, int)

DONE, FAILED, USAGE, UNREADABLE, MISSING_EXTRA, INTERRUPTED = 0, 1, 2, 3, 4, 130
EXIT_CODES = f"""\
exit codes:
  {DONE}    done
  {FAILED}    the output could not be written, or the answers of bench differ
  {USAGE}    the command line makes no sense
  {UNREADABLE}    the log cannot be read, or makes no sense with these settings
  {MISSING_EXTRA}    an optional package is missing: pip install 'ttc-fast[demo]'
  {INTERRUPTED}  interrupted
"""
DEMO = f"""\
Replay a recorded log of laser scans through ttc_fast.ScanTTC.nearest, frame by frame: print a table of the
time to collision (TTC) and draw a picture of it. Without PATH it replays the approach that comes with the
package: a small car that brakes late for a parked box.

Logs it can read: {", ".join(FORMATS)}, a NumPy archive with the arrays t, ranges, angle_min, angle_increment,
range_min, range_max, and optionally v (speed), w (yaw rate), mount, outline. All in m, m/s, rad and s; x is
forward, y is left.
"""
BENCH = """\
Time ttc_fast.ScanTTC against the NumPy reference on this machine, in turns, and check that they agree.
"""


class CommandError(Exception):
    """Something went wrong that a person can put right."""

    def __init__(self, code: int, problem: str) -> None:
        super().__init__(problem)
        self.code = code


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command ``ttc-fast``.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments; those of the process when None.

    Returns
    -------
    int
        Exit code, as ``ttc-fast --help`` lists them.

    Raises
    ------
    SystemExit
        With a code of the same list: from argparse, after ``--help`` or a command line that makes no sense; from rich,
        when nobody reads the output any more.

    Examples
    --------
    >>> from ttc_fast.cli import main
    >>> main(["demo", "scan.xyz", "--no-plot"])  # an error, on standard error
    3
    """
    arguments = _parser().parse_args(argv)
    try:
        arguments.run(arguments)
    except LogError as error:
        return _complain(UNREADABLE, str(error))
    except CommandError as error:
        return _complain(error.code, str(error))
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in ("rich", "matplotlib"):
            raise
        return _complain(MISSING_EXTRA, f"this needs {package}, which is not installed: pip install 'ttc-fast[demo]'")
    except KeyboardInterrupt:
        return INTERRUPTED
    return DONE


def _complain(code: int, problem: str) -> int:
    print(f"ttc-fast: {problem}", file=sys.stderr)
    return code


def _demo(arguments: argparse.Namespace) -> None:
    from ttc_fast.demo import SAMPLE, replay, table

    if arguments.plot:
        from ttc_fast import plot  # now rather than after the table, to say early that it is missing

    log = open_log(arguments.path or SAMPLE)
    scanner = Scanner(**{**vars(log.scanner), **_given(arguments, "range_min", "mount", "outline")})
    try:
        result = replay.replay(
            log,
            table.watch(log),
            scanner=scanner,
            threshold=arguments.threshold,
            speed=arguments.speed,
            support=arguments.support,
        )
    except ValueError as error:
        raise LogError(log.path, str(error)) from error
    console = table.open_console()
    table.report(result, console, rows=arguments.rows)
    if arguments.plot:
        figure = plot.draw(result, f"{log.path.name}, {result.scan.beams} beams")
        table.line(console, "  picture", str(_save(figure, arguments.out / f"{log.path.stem}.png")))


def _given(arguments: argparse.Namespace, *names: str) -> dict[str, Any]:
    """Return those of the named options that were given."""
    values = {name: getattr(arguments, name) for name in names}
    return {n: tuple(v) if isinstance(v, list) else v for n, v in values.items() if v is not None}


def _save(figure: Figure, picture: Path) -> Path:
    try:
        picture.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(picture, dpi=110)
    except OSError as error:
        problem = f"cannot write {picture}: {error.strerror or error}; choose another folder with --out"
        raise CommandError(FAILED, problem) from error
    return picture


def _bench(arguments: argparse.Namespace) -> None:
    from ttc_fast import bench
    from ttc_fast.demo import table

    try:
        timings = bench.compare(arguments.beams, arguments.rounds)
    except bench.AnswersDifferError as error:
        raise CommandError(FAILED, str(error)) from error
    bench.report(timings, arguments.beams, table.open_console())


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="ttc-fast",
        description="Time to collision from recorded laser scans.",
        epilog=EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"ttc-fast {version('ttc-fast')}, kernels: {SIMD_LEVEL}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    _demo_options(_command(commands, "demo", _demo, "replay a log: a table and a picture of its TTC", DEMO))
    _bench_options(_command(commands, "bench", _bench, "time ttc_fast against its NumPy reference", BENCH))
    return parser


def _command(
    commands: argparse._SubParsersAction[argparse.ArgumentParser],
    name: str,
    run: Callable[[argparse.Namespace], None],
    summary: str,
    description: str,
) -> argparse.ArgumentParser:
    command = commands.add_parser(
        name,
        help=summary,
        description=description,
        epilog=EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.set_defaults(run=run)
    return command


def _demo_options(demo: argparse.ArgumentParser) -> None:
    add = demo.add_argument
    add("path", nargs="?", type=Path, metavar="PATH", help="log to replay (default: the one that comes with it)")
    add("--threshold", type=_positive, default=0.7, metavar="S", help="mark a TTC below this, s (default: %(default)s)")
    add(
        "--support",
        type=_count,
        default=1,
        metavar="N",
        help="neighbouring beams that must agree with the nearest one; 0 lets a lone reading decide (default: 1)",
    )
    add(
        "--rows",
        type=_count,
        default=20,
        metavar="N",
        help="about how many rows to print; 0 prints all (default: %(default)s)",
    )
    add(
        "--out", type=Path, default=Path("demo-out"), metavar="DIR", help="folder of the picture (default: %(default)s)"
    )
    add("--no-plot", dest="plot", action="store_false", help="draw no picture")
    instead = demo.add_argument_group("instead of what the log says")
    add = instead.add_argument
    add("--speed", type=_finite, metavar="V", help="of the vehicle, m/s, negative when reversing")
    add("--range-min", type=_finite, metavar="M", help="readings below this are discarded, m")
    add("--mount", type=_finite, nargs=3, metavar=("X", "Y", "YAW"), help="of the scanner on the vehicle, m and rad")
    add(
        "--outline",
        type=_finite,
        nargs=4,
        metavar=("REAR", "FRONT", "RIGHT", "LEFT"),
        help="of the vehicle, m; rear and right are usually negative",
    )


def _bench_options(bench: argparse.ArgumentParser) -> None:
    add = bench.add_argument
    add("--beams", type=_positive_count, default=1080, metavar="N", help="beams of a scan (default: %(default)s)")
    add(
        "--rounds",
        type=_positive_count,
        default=50,
        metavar="N",
        help="turns that each side gets; medians are reported (default: %(default)s)",
    )


def _number(kind: type[T], wanted: str, accepts: Callable[[T], bool]) -> Callable[[str], T]:
    """Make a reader of numbers that says what it wanted."""

    def read(text: str) -> T:
        try:
            number = kind(text)
        except ValueError:
            number = None
        if number is None or not accepts(number):
            raise argparse.ArgumentTypeError(f"must be {wanted}, got {text!r}")
        return number

    return read


_finite = _number(float, "a finite number", math.isfinite)
_positive = _number(float, "a finite number above 0", lambda number: 0.0 < number < math.inf)
_count = _number(int, "a whole number from 0", lambda number: number >= 0)
_positive_count = _number(int, "a whole number from 1", lambda number: number >= 1)


if __name__ == "__main__":
    sys.exit(main())
