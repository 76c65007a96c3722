"""``ttc-fast replay``: recorded logs in, tables and pictures out, by the code that brakes.

One log is replayed in this process, and printed. Several logs are replayed by processes of this machine or by the
workers of a Dask scheduler, and end in a table with a line each.
"""

from __future__ import annotations

from contextlib import nullcontext
from importlib import import_module
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from ttc_fast._exit_codes import DONE, FAILED, PARTIAL, UNREADABLE, USAGE
from ttc_fast.cli import options
from ttc_fast.cli.exits import CommandError
from ttc_fast.configuration import ConfigurationError
from ttc_fast.logs import FORMATS
from ttc_fast.logs.raw_clouds import KITTI_LIDAR
from ttc_fast.logs.storage import Location, found, located

if TYPE_CHECKING:
    import argparse
    from concurrent.futures import Executor

    from rich.console import Console

    from ttc_fast.replay import Files, Replay, Replayed, Settings
    from ttc_fast.replay.replayed import Chapter

SUMMARY = "replay logs through the brake: when would it have braked, and why"
USAGE_LINE = "ttc-fast replay [OPTION ...] PATH [PATH ...]"
DESCRIPTION = f"""\
  ttc-fast replay drive.bag --outline -0.1 0.4 -0.15 0.15 --plot drive.png
  ttc-fast replay drive.mcap --topic /scan --criterion IttcThreshold:threshold=0.7 --out rows.csv
  ttc-fast replay velodyne/ --speed 8 --gate-x {KITTI_LIDAR.vehicle_reach:g} 40 --out rows.parquet
  ttc-fast replay logs/*.bag --config car.toml --summary table.csv
  ttc-fast replay 's3://fleet/2026-*/*.mcap' --out s3://results/november --scheduler tcp://host:8786

Replay recorded logs, frame by frame, through the code that brakes on the vehicle: when would it have braked, and why?
{fill(f"PATH is {FORMATS}.", 118)}
Several paths are replayed on all cores at once, or by the workers of --scheduler, and end in a table with a line each.
A path may have *, ? and [, and may be a URL, s3://fleet/2026-*/*.mcap, of a storage that fsspec knows.
"""
COMMON = (
    "--topic", "--speed", "--mount", "--outline", "--sensor-height", "--criterion", "--config", "--out",
    "--plot", "--rows",
)  # fmt: skip


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("paths", nargs="+", type=located, metavar="PATH", help="A log to replay.")
    options.add(parser)
    out = parser.add_argument_group("what comes out")
    out.add_argument(
        "--out",
        type=located,
        metavar="FILE|DIR",
        help="Write a row for each frame as .csv, .jsonl or .parquet. Each of several logs has a file of its own, with "
        "the name of the log behind that of FILE. A name without an ending is a folder: it gets rows/ with a Parquet "
        "file for each log, and the table logs.parquet with a line for each. A log that is done there is left out.",
    )
    out.add_argument(
        "--summary",
        type=located,
        metavar="FILE",
        help="Write a table with a line for each log, .csv or .parquet: least TTC, exposure, brakes, what was lost.",
    )
    out.add_argument("--again", action="store_true", help="Replay also the logs that are done in the folder of --out.")
    out.add_argument(
        "--plot", type=located, metavar="FILE", help="Draw a picture, .png or .svg; of several logs one each."
    )
    out.add_argument(
        "--rerun", type=located, metavar="FILE", help="Write a recording for Rerun, .rrd; of several logs one each."
    )
    out.add_argument(
        "--mcap", type=located, metavar="FILE", help="Write a recording for Foxglove, .mcap; of several logs one each."
    )
    out.add_argument(
        "--report", type=located, metavar="FILE", help="Write a report, .html: events with their frames, and curves."
    )
    options.add_rows(out)
    out.add_argument(
        "--jobs",
        type=options.positive_count,
        metavar="N",
        help="Replay in at most N processes (default: all cores); 1 starts none.",
    )
    out.add_argument(
        "--scheduler", metavar="URL", help="Replay on the workers of this Dask scheduler, such as tcp://host:8786."
    )


def run(arguments: argparse.Namespace) -> None:
    """Replay one log or several."""
    from ttc_fast.replay import Files, Replayed
    from ttc_fast.replay.replayed import exit_code_of
    from ttc_fast.replay.terminal import open_console

    settings = options.settings(arguments)
    files = Files(arguments.out, arguments.plot, arguments.rerun, arguments.mcap, arguments.report)
    into_folder = _check_outputs(files, arguments.summary)
    logs = found(arguments.paths)
    spare_logs(logs, [arguments.summary], "--summary")
    if len(logs) > 1 or into_folder or arguments.scheduler is not None:
        out, files = (files.rows, files._replace(rows=None)) if into_folder else (None, files)
        if arguments.again and not into_folder:
            raise CommandError(USAGE, "--again needs --out to be a folder")
        if arguments.scheduler is not None and arguments.jobs is not None:
            problem = "--jobs cannot be combined with --scheduler: its workers are counted where they start"
            raise CommandError(USAGE, problem)
        how = {"out": out, "again": arguments.again, "jobs": arguments.jobs}
        results = run_many(logs, settings, files, arguments.scheduler, **how)
        _write_about(results, arguments.summary, None)
        check_many(results)
        return
    spare_logs(logs, [arguments.out])
    spare_logs(logs, [arguments.mcap], "--mcap")
    played, chapter = show(logs[0], settings, open_console(), arguments.rows, files)
    result = Replayed(str(logs[0]), played.summary, exit_code_of(played.summary), chapter=chapter)
    _write_about([result], arguments.summary, arguments.report)
    check(played)


def show(
    path: Location, settings: Settings, console: Console, rows: int, files: Files
) -> tuple[Replay, Chapter | None]:
    """Replay one log: write its rows, draw it, and print rows and summary; return it with its chapter of a report."""
    from ttc_fast.replay import Replay
    from ttc_fast.replay.output import OutputError, play
    from ttc_fast.replay.terminal import print_rows, print_summary, print_used, show_live

    try:
        replay = Replay(path, settings)
        chapter = play(replay, show_live(replay, console), files)
    except ConfigurationError as error:  # settings that make no sense for this log are a mistake of usage
        raise CommandError(USAGE, f"{path}: {settings.typed(error)}") from error
    except OutputError as error:
        raise CommandError(FAILED, str(error)) from error
    print_used(replay, console)
    print_rows(replay, console, rows)
    print_summary(replay, console)
    return replay, chapter


def check(played: Replay) -> None:
    """Raise if a part of a log was lost, or it has no frames."""
    from ttc_fast.replay.replayed import exit_code_of

    code = exit_code_of(played.summary)
    if code != DONE:
        raise CommandError(code, played.summary.lost or f"{played.summary.path}: has no frames")


def _write_about(results: list[Replayed], summary: Location | None, report: Location | None) -> None:
    """Write the table of logs and the report, where they are asked for."""
    from ttc_fast.replay.output import OutputError, report_on, suffix_of, writing
    from ttc_fast.replay.table import write_table

    try:
        report_on(results, report)
        if summary is not None:
            with writing(summary, "choose another --summary") as file:
                write_table(results, file, suffix_of(summary))
    except OutputError as error:
        raise CommandError(FAILED, str(error)) from error


def _check_outputs(files: Files, summary: Location | None) -> bool:
    """Raise if a name says no format, or a package that it needs is missing; return whether rows go into a folder."""
    from ttc_fast.replay.output import PICTURES, suffix_of
    from ttc_fast.replay.row import WRITERS
    from ttc_fast.replay.table import TABLES

    into_folder, (out, plot, rerun, mcap, report) = False, files
    if out is not None:
        suffix = suffix_of(out)
        into_folder = not suffix or (isinstance(out, Path) and out.is_dir())
        if not into_folder and suffix not in WRITERS:
            raise CommandError(USAGE, f"--out must end in {', '.join(WRITERS)}, or be a folder, got {out}")
    for option, place, endings in (
        ("--summary", summary, TABLES),
        ("--plot", plot, PICTURES),
        ("--rerun", rerun, (".rrd",)),
        ("--mcap", mcap, (".mcap",)),
        ("--report", report, (".html",)),
    ):
        if place is not None and suffix_of(place) not in endings:
            raise CommandError(USAGE, f"{option} must end in {' or '.join(endings)}, got {place}")
    parquet = any(each is not None and suffix_of(each) == ".parquet" for each in (out, summary))
    for package, is_needed in (
        ("pyarrow", into_folder or parquet),
        ("matplotlib", any(each is not None for each in (plot, rerun, mcap, report))),
        ("rerun", rerun is not None),
        ("mcap_protobuf", mcap is not None),
        ("foxglove_schemas_protobuf", mcap is not None),
        ("bokeh", report is not None),
    ):
        if is_needed:
            import_module(package)
    return into_folder


def spare_logs(logs: list[Location], outs: list[Location | None], option: str = "--out") -> None:
    """Raise if something would be written over a log that is to be read."""
    for out in outs:
        if not isinstance(out, Path) or not out.exists():
            continue
        if any(isinstance(log, Path) and log.exists() and out.samefile(log) for log in logs):
            raise CommandError(USAGE, f"{out}: is a log that is to be replayed; choose another {option}")


def run_many(
    logs: list[Location], settings: Settings, files: Files, scheduler: str | None, **how: Any
) -> list[Replayed]:
    """Replay several logs, here or on the workers of a scheduler, and print a line for each."""
    from ttc_fast.replay import replay_many
    from ttc_fast.replay.output import OutputError, each_of
    from ttc_fast.replay.terminal import open_console, print_summaries, show_progress

    spare_logs(logs, each_of(files.rows, logs))
    spare_logs(logs, each_of(files.mcap, logs), "--mcap")
    try:
        with nullcontext() if scheduler is None else _connected(scheduler) as executor, show_progress() as progress:
            results = replay_many(logs, settings, files=files, executor=executor, progress=progress, **how)
    except OutputError as error:
        raise CommandError(FAILED, str(error)) from error
    print_summaries([each.summary for each in results], open_console())
    return results


def check_many(results: list[Replayed]) -> None:
    """Raise if one of several logs failed, or could not be read whole."""
    failed = [each for each in results if each.exit_code == FAILED]
    if failed:
        problem = f"of {len(results)} logs {len(failed)} failed, such as {failed[0].summary.lost}"
        raise CommandError(FAILED, problem)
    damaged = [each for each in results if each.summary.lost]
    if damaged:
        nothing = not any(each.summary.frames for each in results)
        problem = f"of {len(results)} logs {len(damaged)} could not be read whole"
        raise CommandError(UNREADABLE if nothing else PARTIAL, problem)


def _connected(address: str) -> Executor:
    import distributed  # noqa: F401 - if it is missing, main says which extra brings it

    from ttc_fast.replay.executors import Scheduler

    try:
        return Scheduler.at(address)
    except (OSError, ValueError) as error:
        raise CommandError(FAILED, f"no Dask scheduler answers at {address}: {error}") from error
