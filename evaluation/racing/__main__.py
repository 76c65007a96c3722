"""``python -m evaluation.racing``: laps, drives with steering at random, and the tables."""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from evaluation.racing.course import names
from evaluation.racing.drives import SEED, Outcome, lap_drive, random_drive
from evaluation.report import Report, console, write_into
from ttc_fast import BrakeController, StoppingDistance

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ttc_fast import ScanTTC


def default(scan: ScanTTC) -> BrakeController:
    return BrakeController(scan=scan)


def stopping(scan: ScanTTC) -> BrakeController:
    return BrakeController([StoppingDistance()], scan=scan)


def never(scan: ScanTTC) -> BrakeController:
    return BrakeController([StoppingDistance(1e6, 0.0, 0.0)], scan=scan, hold=0.0)


PLANNED = ", planned path"
RACED = f"racing{PLANNED}"
"""The settings that are driven in full; the others are compared with them in a few drives."""
SETTINGS: dict[str, tuple[Callable[[ScanTTC], BrakeController], bool]] = {
    RACED: (BrakeController.racing, True),
    "racing": (BrakeController.racing, False),
    "careful": (BrakeController.careful, False),
    f"default{PLANNED}": (default, True),
    "default": (default, False),
    "StoppingDistance()": (stopping, False),
    "no brake": (never, False),
}
"""The settings that are compared, and whether they are given the line that the driver follows."""
CHOSEN_ON = ("Spielberg", "berlin", "random 0", "random 1", "random 2")
"""The courses on which the settings were chosen, with drives at random of ``SEED``."""
LOOKED_AT = ("Oschersleben", "skirk")
"""The other courses there are: settings of an earlier version were chosen on them as well."""
MAPS = ("berlin", "skirk")
"""The maps without a race line, which are wide enough to steer at random."""
UNSEEN_SEED = 12
"""The seed of drives at random of which none was driven before the settings were chosen."""


def courses() -> list[str]:
    """Return all courses there are, all of them turned round, and six at random that were not driven before."""
    turned = [f"{name} {how}" for how in ("mirrored", "reversed") for name in names()]
    return [*names(), *(f"random {seed}" for seed in range(100, 106)), *turned]


def seen(name: str) -> str:
    """Return whether settings were chosen on a course."""
    return "chosen on" if name in CHOSEN_ON else "looked at before" if name in LOOKED_AT else "unseen"


def laps_table(outcomes: Sequence[tuple[str, Outcome]], laps: float) -> Report:
    """Make the table of laps: a row for each setting and course, onsets at each speed."""
    speeds = sorted({each.speed for _, each in outcomes})
    rows = []
    for setting in dict.fromkeys(name for name, _ in outcomes):
        for where in dict.fromkeys(each.course for _, each in outcomes):
            mine = {each.speed: each for name, each in outcomes if name == setting and each.course == where}
            cells = [cell(mine[speed], laps) if speed in mine else "-" for speed in speeds]
            rows.append([setting, where, seen(where), *cells])
    legend = (
        f"{laps:g} laps each. Times that it began to brake; with the laps that it drove where it did not finish, and "
        "'hit' where that ended it."
    )
    return Report("Laps", legend, ["setting", "course", "data", *(f"{speed:g} m/s" for speed in speeds)], rows)


def cell(outcome: Outcome, laps: float) -> str:
    done = "" if outcome.laps >= laps else f", {max(outcome.laps, 0.0):.1f} laps"
    return f"{outcome.onsets}{done}{', hit' if outcome.hits else ''}"


def random_table(outcomes: Sequence[tuple[str, Outcome]], seed: int) -> Report:
    """Make the table of drives with steering at random: a row for each setting and course."""
    rows = []
    for setting in dict.fromkeys(name for name, _ in outcomes):
        for where in dict.fromkeys(each.course for _, each in outcomes):
            mine = [each for name, each in outcomes if name == setting and each.course == where]
            hit = [each for each in mine if each.hits]
            speeds = ", ".join(f"{each.hit_speed:.1f}" for each in hit) or "-"
            braked = f"{100.0 * np.mean([each.braked for each in mine]):.0f} %"
            rows.append([setting, where, str(len(mine)), str(len(hit)), speeds, braked])
    legend = (
        f"From standstill, up to 6 m/s, for 20 s or until it stands for 3 s, seed {seed}. Speeds of hits in m/s. "
        f"Settings were chosen with drives of seed {SEED}; those of seed {UNSEEN_SEED} are unseen on every course."
    )
    columns = ["setting", "course", "drives", "hits", "at", "frames braked"]
    return Report("Steering at random", legend, columns, rows)


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m evaluation.racing", description=__doc__)
    parser.add_argument(
        "--compare", action="store_true", help="all settings on the maps: 1 lap at 3, 5, 8 m/s; 20 drives"
    )
    parser.add_argument("--laps", type=float, help="laps of each drive (default 4)")
    parser.add_argument("--speeds", type=float, nargs="*", help="m/s (default 2 to 8)")
    parser.add_argument("--runs", type=int, help="drives at random on each wide course (default 40)")
    parser.add_argument("--settings", nargs="*", help=f"which of {', '.join(SETTINGS)} (default: racing)")
    parser.add_argument("--courses", nargs="*", help="which of them, such as 'random 7' (default: all)")
    parser.add_argument("--seed", type=int, help=f"of drives at random (default {UNSEEN_SEED})")
    parser.add_argument("--processes", type=int, help="default: as many as there are processors")
    parser.add_argument("--markdown", type=Path, help="a document to put the tables into, such as docs/racing.md")
    chosen = parser.parse_args()
    few = chosen.compare
    defaults = {
        "laps": 1.0 if few else 4.0,
        "speeds": [3.0, 5.0, 8.0] if few else [2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0],
        "runs": 20 if few else 40,
        "settings": list(SETTINGS) if few else [RACED],
        "courses": list(MAPS) if few else courses(),
        "seed": SEED if few else UNSEEN_SEED,
    }
    for name, value in defaults.items():
        if getattr(chosen, name) is None:
            setattr(chosen, name, value)
    wide = [name for name in chosen.courses if name in MAPS or name.startswith("random")]
    with ProcessPoolExecutor(chosen.processes) as pool:
        lapped: list[tuple[str, Any]] = []
        steered: list[tuple[str, Any]] = []
        for setting in chosen.settings:
            make, planned = SETTINGS[setting]
            for name in chosen.courses:
                for speed in chosen.speeds:
                    lapped.append((setting, pool.submit(lap_drive, name, speed, chosen.laps, make, planned)))
            at_random = setting.removesuffix(PLANNED)  # nobody plans there
            if at_random not in dict(steered):
                for name in wide:
                    for run in range(chosen.runs):
                        steered.append((at_random, pool.submit(random_drive, name, run, make, chosen.seed)))
        reports = []
        if lapped:
            reports.append(laps_table([(setting, each.result()) for setting, each in lapped], chosen.laps))
        if steered:
            reports.append(random_table([(setting, each.result()) for setting, each in steered], chosen.seed))
    for report in reports:
        console().print(report.rich())
    if chosen.markdown:
        command = f"python -m evaluation.racing{' --compare' if few else ''}"
        write_into(chosen.markdown, command, "\n".join(each.markdown() for each in reports))


if __name__ == "__main__":
    main()
