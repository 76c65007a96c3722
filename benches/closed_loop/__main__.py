"""``python -m benches.closed_loop``: thousands of drives, in all processes there are, and the tables."""

from __future__ import annotations

import argparse
import math
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benches.closed_loop.drive import Drive, drive
from ttc_fast import IttcThreshold, StoppingDistance, SweptPathThreshold

if TYPE_CHECKING:
    from collections.abc import Sequence

SETTINGS: dict[str, dict[str, Any]] = {
    "default": {},
    "IttcThreshold(1.5)": {"criteria": [IttcThreshold(1.5)]},
    "IttcThreshold(0.5)": {"criteria": [IttcThreshold(0.5)]},
    "SweptPathThreshold(1.5)": {"criteria": [SweptPathThreshold(1.5)]},
    "StoppingDistance()": {"criteria": [StoppingDistance()]},
    "default, 1 of 1": {"trigger": (1, 1)},
}
"""What is compared; ``{}`` is the controller as it comes."""


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m benches.closed_loop", description=__doc__)
    parser.add_argument("--runs", type=int, default=10_000, help="drives of the default (default %(default)s)")
    parser.add_argument("--others", type=int, default=2_000, help="drives of each other setting (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of all drives (default %(default)s)")
    parser.add_argument("--processes", type=int, help="default: as many as there are processors")
    arguments = parser.parse_args()
    console = Console()
    console.print(f"seed {arguments.seed}: drive i is np.random.default_rng([{arguments.seed}, i])")
    columns = ("setting", "drives", "possible", "collisions", "false stops", "cautious", "earliest", "latest", "room")
    table = Table(*columns)
    by_kind = Table("kind", "drives", "possible", "collisions", "unavoidable", "false stops", "cautious")
    with ProcessPoolExecutor(arguments.processes) as pool:
        for name, settings in SETTINGS.items():
            runs = range(arguments.runs if not settings else arguments.others)
            job = partial(drive, arguments.seed, **settings)
            drives = list(track(pool.map(job, runs, chunksize=20), name, len(runs), console=console))
            table.add_row(name, *summary(drives))
            if not settings:
                for kind in dict.fromkeys(each.kind for each in drives):
                    by_kind.add_row(kind, *of_kind([each for each in drives if each.kind == kind]))
                tell(console, drives)
    console.print(table, by_kind)


def summary(drives: Sequence[Drive]) -> list[str]:
    """One row: earliest and latest brake as time before the collision there would have been, and the room left."""
    early = [each.hits_without - each.braked_at for each in drives if each.possible and each.braked_at < math.inf]
    room = [each.margin for each in drives if each.possible and not math.isnan(each.margin)]
    return [
        str(len(drives)),
        str(sum(each.possible for each in drives)),
        str(sum(each.crashed for each in drives)),
        str(sum(each.false_stop for each in drives)),
        str(sum(each.needless and each.cause for each in drives)),
        f"{max(early, default=math.nan):.2f} s",
        f"{min(early, default=math.nan):.2f} s",
        f"{np.min(room, initial=math.inf):.2f} m",
    ]


def of_kind(drives: Sequence[Drive]) -> list[str]:
    """One row of a kind of scenario."""
    unavoidable = sum(each.collided and not each.possible for each in drives)
    counts = [each.strip() for each in summary(drives)[:5]]
    return [*counts[:3], str(unavoidable), *counts[3:]]


def tell(console: Console, drives: Sequence[Drive]) -> None:
    """Name every drive that went wrong, to look at it again."""
    for each in drives:
        if each.crashed or each.false_stop:
            console.print(f"{'crash' if each.crashed else 'false stop'}: {each}")


if __name__ == "__main__":
    main()
