"""``ttc-fast replay``: recorded logs in, tables and pictures out, by the code that brakes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ttc_fast.cli import replay_options
from ttc_fast.cli.exits import FAILED, PARTIAL, UNREADABLE, USAGE, CommandError
from ttc_fast.logs import FORMATS, LogError

if TYPE_CHECKING:
    import argparse

    from ttc_fast.replay import Replay, Settings, Summary

SUMMARY = "replay logs through the brake: when would it have braked, and why"
DESCRIPTION = f"""\
Replay recorded logs, frame by frame, through the code that brakes on the vehicle: when would it have braked, and why?

PATH is {FORMATS}.
Several paths are replayed on all cores at once, and end in a table with a line each.

Scans are judged by what their beams and, with an outline, the vehicle's path run into; a log that does not know the
speed by how the ranges change. Clouds and tables of distances are tracked, and the brake judges what the tracker says.

  ttc-fast replay drive.bag --outline -0.1 0.4 -0.15 0.15 --plot drive.png
  ttc-fast replay drive.mcap --topic /scan --criterion IttcThreshold:threshold=0.7 --out rows.csv
  ttc-fast replay velodyne/ --speed 8 --gate-x 2 40 --out rows.parquet
  ttc-fast replay logs/*.bag --config car.toml --out rows.csv
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("paths", nargs="+", type=Path, metavar="PATH", help="log to replay")
    replay_options.add(parser)
    out = parser.add_argument_group("what comes out")
    out.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="write a row for each frame, as .csv, .jsonl or .parquet; of several logs a file each, FILE with the "
        "name of the log behind it",
    )
    out.add_argument("--plot", type=Path, metavar="FILE", help="draw a picture, .png or .svg; of several logs likewise")
    out.add_argument(
        "--rows",
        type=replay_options.count,
        default=20,
        metavar="N",
        help="about how many rows to print; 0 prints none (default: %(default)s)",
    )
    out.add_argument("--jobs", type=replay_options.positive_count, metavar="N", help="processes (default: all cores)")


def run(arguments: argparse.Namespace) -> None:
    """Replay, write, draw, print."""
    settings = replay_options.settings(arguments)
    _check_outputs(arguments)
    if len(arguments.paths) > 1:
        _run_many(arguments, settings)
        return
    from ttc_fast.demo.table import open_console
    from ttc_fast.replay.screen import print_rows, print_summary, watch

    console = open_console()
    path = arguments.paths[0]
    played = _open(path, settings)
    _play(played, arguments.out, arguments.plot, rows=lambda: watch(played, console))
    print_rows(played, console, arguments.rows)
    print_summary(played.summary, console)
    if played.summary.lost:
        raise CommandError(PARTIAL if played.summary.frames else UNREADABLE, played.summary.lost)


def _check_outputs(arguments: argparse.Namespace) -> None:
    """Refuse names that say no format, and find out early that a package is missing."""
    from ttc_fast.replay.rows_out import WRITERS

    if arguments.out is not None:
        suffix = arguments.out.suffix.lower()
        if suffix not in WRITERS:
            raise CommandError(USAGE, f"--out must end in {', '.join(WRITERS)}, got {arguments.out}")
        if suffix == ".parquet":
            import pyarrow  # noqa: F401
    if arguments.plot is not None:
        if arguments.plot.suffix.lower() not in (".png", ".svg"):
            raise CommandError(USAGE, f"--plot must end in .png or .svg, got {arguments.plot}")
        import matplotlib  # noqa: F401


def _open(path: Path, settings: Settings) -> Replay:
    from ttc_fast.configuration import ConfigurationError
    from ttc_fast.replay import Replay

    try:
        return Replay(path, settings)
    except ConfigurationError as error:
        raise CommandError(USAGE, f"{path}: {error}") from error


def _play(played: Replay, out: Path | None, plot: Path | None, rows: Any = None) -> None:
    """Replay to the end; what is lost on the way is in the summary."""
    from ttc_fast.configuration import ConfigurationError
    from ttc_fast.replay.rows_out import WRITERS

    try:
        writer = None if out is None else WRITERS[out.suffix.lower()](out)
    except OSError as error:
        raise CommandError(FAILED, f"cannot write {out}: {error.strerror or error}; choose another --out") from error
    try:
        try:
            if writer is None:
                for _ in rows() if rows else played:
                    pass
            else:
                write = writer.write
                for row in rows() if rows else played:
                    write(row)
        except LogError:
            pass  # the summary tells
        except ConfigurationError as error:
            raise CommandError(USAGE, f"{played.log.path}: {error}") from error
        finally:
            if writer is not None:
                writer.close()
    except OSError as error:
        raise CommandError(FAILED, f"cannot write {out}: {error.strerror or error}; choose another --out") from error
    if plot is not None and played.summary.frames:
        _draw(played, plot)


def _draw(played: Replay, plot: Path) -> None:
    from ttc_fast.replay.picture import draw

    try:
        figure = draw(played)
        figure.draw_without_rendering()  # once more than matplotlib does: its layout settles in two steps
        figure.savefig(plot, dpi=110)
    except OSError as error:
        raise CommandError(FAILED, f"cannot write {plot}: {error.strerror or error}; choose another --plot") from error


def _one_of_many(path: Path, settings: Settings, out: Path | None, plot: Path | None) -> Summary:
    """Replay one log, in a process of its own."""
    from ttc_fast.replay import Summary

    try:
        played = _open(path, settings)
    except (LogError, CommandError) as error:
        summary = Summary(str(path), 0.0, 0.0)
        summary.lost = str(error)
        return summary
    _play(played, out, plot)
    return played.summary


def _run_many(arguments: argparse.Namespace, settings: Settings) -> None:
    """Replay several logs on all cores."""
    import os
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    from rich.console import Console
    from rich.progress import Progress

    from ttc_fast.demo.table import open_console
    from ttc_fast.replay.screen import print_summaries

    paths = arguments.paths
    outs, plots = _each(arguments.out, paths), _each(arguments.plot, paths)
    jobs = min(arguments.jobs or os.cpu_count() or 1, len(paths))
    stderr = Console(stderr=True)
    progress = Progress(console=stderr, transient=True, disable=not stderr.is_terminal)
    with progress, ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        each = pool.map(_one_of_many, paths, [settings] * len(paths), outs, plots)
        summaries = list(progress.track(each, total=len(paths), description=f"{len(paths)} logs"))
    print_summaries(summaries, open_console())
    damaged = [summary for summary in summaries if summary.lost]
    if damaged:
        nothing = not any(summary.frames for summary in summaries)
        problem = f"of {len(paths)} logs {len(damaged)} could not be read whole"
        raise CommandError(UNREADABLE if nothing else PARTIAL, problem)


def _each(file: Path | None, paths: list[Path]) -> list[Path | None]:
    """Name a file for each log: the name of the log is put behind the name that was given."""
    if file is None:
        return [None] * len(paths)
    named: list[Path | None] = []
    for path in paths:
        stem = f"{file.stem}-{path.resolve().name}"
        name, number = file.with_name(stem + file.suffix), 2
        while name in named:
            name, number = file.with_name(f"{stem}-{number}{file.suffix}"), number + 1
        named.append(name)
    return named
