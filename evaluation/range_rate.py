"""Times by range rates beside those by odometry, over recorded logs: ``python -m evaluation.range_rate LOG``."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

import ttc_fast
from evaluation.report import Report, console, write_into
from ttc_fast.logs import open_log

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from ttc_fast.logs import ScanLog

    Floats = NDArray[np.float64]

ALARM = 1.5
"""The TTC below which a frame is an alarm, s."""

STANDING, STRAIGHT = 0.05, 0.1
"""The speed (m/s) below which a car stands, and the yaw rate (rad/s) below which it drives straight on."""

SECTORS = ((0.0, 0.2), (0.2, 0.8), (0.8, 1.4))
"""Ranges of angles from straight ahead to either side, rad."""


@dataclass(frozen=True)
class Replay:
    """A log as numbers; its odometry is ``delay`` scans ahead of the scans."""

    log: ScanLog
    stamps: Floats
    ranges: NDArray[Any]
    speeds: Floats
    yaw_rates: Floats
    delay: int

    @classmethod
    def of(cls, log: ScanLog, delay: int) -> Replay:
        """Read a log."""
        frames = list(log)
        speeds = np.array([math.nan if frame.speed is None else frame.speed for frame in frames])
        yaw_rates = np.array([frame.yaw_rate for frame in frames])
        speeds, yaw_rates = (np.pad(values, (delay, 0), "edge")[: len(frames)] for values in (speeds, yaw_rates))
        stamps = np.array([frame.stamp for frame in frames])
        return cls(log, stamps, np.stack([frame.ranges for frame in frames]), speeds, yaw_rates, delay)

    def scanner(self, **settings: Any) -> ttc_fast.ScanTTC:
        """Return the scanner of the log; a blind scan is no alarm here."""
        it = self.log.scanner
        sensor: dict[str, Any] = {"range_min": it.range_min, "range_max": it.range_max, "no_data": math.inf}
        return ttc_fast.ScanTTC(it.angle_min, it.angle_increment, it.beams, **sensor, **settings)

    def by_odometry(self, **settings: Any) -> Floats:
        """Return the least TTC of each scan by the vehicle's own speed, s."""
        if np.isnan(self.speeds).any():
            return np.full(len(self.stamps), np.nan)
        return self.scanner(**settings).min(self.ranges, self.speeds, self.yaw_rates)

    def by_range_rate(self, *, yaw: bool = True, confirmed: bool = False, **settings: Any) -> tuple[Floats, Floats]:
        """Return the least TTC of each scan by range rates, without TOO_FEW if ``confirmed``, and the rates."""
        rates = ttc_fast.RangeRate(self.scanner(), **settings)
        ttc, each = np.empty(len(self.stamps)), np.empty_like(self.ranges)
        for i, (stamp, ranges) in enumerate(zip(self.stamps, self.ranges, strict=True)):
            yaw_rate = self.yaw_rates[i] if yaw else 0.0
            nearest = rates.update(ranges, stamp, yaw_rate, range_rate_out=each[i])
            ttc[i] = math.inf if confirmed and nearest.status == ttc_fast.Status.TOO_FEW else nearest.ttc
        return ttc, each.astype(np.float64)


def alarms(replay: Replay) -> Report:
    """Report how often each method alarms, and how its TTC compares with that by odometry."""
    odometry = replay.by_odometry()
    plain, vote = ttc_fast.KthSmallest(1), ttc_fast.NeighbourSupport(count=6, window=4)
    methods = {
        "odometry, plain minimum": odometry,
        "odometry, 6 of 8 neighbours": replay.by_odometry(minimum=vote),
        "range rate, plain minimum": replay.by_range_rate(minimum=plain)[0],
        "range rate (default)": replay.by_range_rate()[0],
        "range rate, without TOO_FEW": replay.by_range_rate(confirmed=True)[0],
        "range rate, yaw rate unknown": replay.by_range_rate(yaw=False)[0],
    }
    rows = [_alarms(name, ttc, odometry) for name, ttc in methods.items() if not np.isnan(ttc).any()]
    ahead = "no odometry" if np.isnan(odometry).any() else f"odometry ahead by {replay.delay}"
    title = f"{replay.log.path.name}: {len(odometry)} scans, {ahead}"
    legend = (
        f"Least TTC of each scan. Alarm: below {ALARM} s. Neighbours: how many must close as well. The last column is "
        "the TTC over that by odometry (plain minimum), where both are finite: 10 %, median, 90 %."
    )
    header = ["method", "scans that close", "alarms", "odometry agrees", "it does not", "not even below 2 s", "ratio"]
    return Report(title, legend, header, rows)


def _alarms(name: str, ttc: Floats, odometry: Floats) -> list[str]:
    alarm, known = ttc < ALARM, not np.isnan(odometry).any()
    counts = [np.isfinite(ttc), alarm, alarm & (odometry < ALARM), alarm & (odometry >= ALARM), alarm & (odometry >= 2)]
    numbers = [str(np.count_nonzero(count)) for count in counts]
    both = np.isfinite(ttc) & np.isfinite(odometry)
    if not known or not both.any():
        return [name, *numbers[:2], "", "", "", ""]
    low, middle, high = np.percentile(ttc[both] / odometry[both], [10, 50, 90])
    return [name, *numbers, f"{low:.2f}, {middle:.2f}, {high:.2f}"]


def beams(replay: Replay) -> Report:
    """Compare range rates with -v cos(angle), beam by beam, while driving straight on."""
    _, rates = replay.by_range_rate()
    scan = replay.scanner()
    expected = -replay.speeds[:, None] * np.cos(scan.angles)
    driving = (np.abs(replay.speeds) > STANDING) & (np.abs(replay.yaw_rates) < STRAIGHT)
    rows = []
    for low, high in SECTORS:
        sector = (np.abs(scan.angles) >= low) & (np.abs(scan.angles) < high)
        chosen = driving[:, None] & sector & ~np.isnan(rates)
        rate, model = rates[chosen], expected[chosen]
        off = np.percentile(np.abs(rate - model), [50, 90])
        correlation = np.corrcoef(rate, model)[0, 1]
        numbers = [f"{off[0]:.3f}", f"{off[1]:.3f}", f"{correlation:.2f}", f"{(rate @ model) / (model @ model):.2f}"]
        rows.append([f"{low} to {high} rad from ahead", str(rate.size), *numbers])
    legend = (
        "Driving straight on. Difference: |range rate + v cos(angle)|, m/s. Slope: of a line through 0 from -v "
        "cos(angle) to the range rate; below 1 where walls are seen at an angle and the beam slides along them."
    )
    header = ["beams", "rates", "difference, median", "90 %", "correlation", "slope"]
    return Report(f"{replay.log.path.name}: beam by beam, odometry ahead by {replay.delay}", legend, header, rows)


def delays(log: ScanLog, most: int = 4) -> Report:
    """Report by how many scans the odometry is ahead: where that is right, turned scans fit together."""
    rows = []
    for delay in range(most + 1):
        replay = Replay.of(log, delay)
        _, rates = replay.by_range_rate()
        turning = np.abs(replay.yaw_rates) > 3 * STRAIGHT
        rated = np.count_nonzero(~np.isnan(rates[turning]), axis=1)
        rows.append([str(delay), f"{rated.mean():.0f}"])
    legend = "Beams with a range rate in a scan, mean over scans while turning faster than 0.3 rad/s."
    return Report(f"{log.path.name}: by how many scans the odometry is ahead", legend, ["scans", "rated"], rows)


def reports(log: ScanLog, delay: int) -> list[Report]:
    """Return every report about a log."""
    replay = Replay.of(log, delay)
    if np.isnan(replay.speeds).any():
        return [alarms(replay)]
    unaligned = [] if delay == 0 else [alarms(Replay.of(log, 0))]
    return [delays(log), *unaligned, alarms(replay), beams(replay)]


def main(argv: Sequence[str] | None = None) -> None:
    """Print the tables, and put them into a document if asked to."""
    parser = argparse.ArgumentParser(prog="python -m evaluation.range_rate", description=__doc__)
    parser.add_argument("logs", nargs="+", type=Path, metavar="LOG", help="logs of scans")
    parser.add_argument("--delay", type=int, default=0, help="by how many scans odometry is ahead (%(default)s)")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="put the tables between the marks there")
    arguments = parser.parse_args(argv)
    every: list[Report] = []
    for path in arguments.logs:
        log = open_log(path)
        if not hasattr(log, "scanner"):
            parser.error(f"{path} is not a log of scans")
        every += reports(cast("ScanLog", log), arguments.delay)
    for report in every:
        console().print(report.rich())
    if arguments.markdown:
        tables = "\n".join(report.markdown() for report in every)
        write_into(arguments.markdown, "python -m evaluation.range_rate", tables)


if __name__ == "__main__":
    main()
