"""Whether the truth is in the intervals, and how wide they are: ``python -m evaluation.intervals``.

Each tracker sees frame after frame, and never a later one. The truth of a simulation is exact. That of the recorded
drive was measured in the images of its camera, by the scale of the rear of the car ahead over many image pairs, and is
right to 0.01 m/s. That of the labelled tracks is the slope of a line through labels before and after.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import ttc_fast
from evaluation import lidar, recorded, tracking
from evaluation.report import Report, console, write_into

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

WARM = 5
"""The number of frames of each simulated drive that warm a tracker up."""
SLOWEST = 0.3
"""The slowest closing speed that counts, m/s."""
SLOPES = 10
"""The number of newest slopes of labels from which a speed is foreseen."""
MOST = 0.85
"""The share of speeds that an interval has to hold at least."""


class Frame(NamedTuple):
    """What a tracker said of one frame, and the truth."""

    seen: ttc_fast.TrackedTTC
    ttc: float  # s
    closing_speed: float  # m/s


class Figures(NamedTuple):
    """Errors of a tracker over many frames, and what they are worth."""

    frames: int
    errors: NDArray[np.float64]
    """The median, the 90 % quantile and the largest relative error of the TTC."""
    in_time: float
    """The share of frames with the true TTC in its interval; a frame without an interval does not have it."""
    in_speed: float
    """The share of frames with the true closing speed in its interval."""
    half_width: float
    """The median half-width of the interval of the closing speed, m/s."""
    speed_error: float
    """The 90 % quantile of the error of the closing speed, m/s."""

    def row(self, name: str) -> list[str]:
        """Return a line of the table."""
        errors = [f"{100 * error:.1f} %" if np.isfinite(error) else "∞" for error in self.errors]
        shares = [f"{100 * share:.0f} %" for share in (self.in_time, self.in_speed)]
        return [name, str(self.frames), *errors, *shares, f"{self.half_width:.3f}", f"{self.speed_error:.3f}"]


LEGEND = "No frame knows a later one. *In* is the share of frames with the truth in the 90 % interval."
FORESEEN = f"How wide an interval of constant width must be to hold {100 * MOST:g} % of the labelled closing speeds."
HEADER = ["drive", "frames", "median", "90 %", "largest", "TTC in", "speed in", "half-width, m/s", "speed 90 %, m/s"]


def figures(frames: Iterable[Frame]) -> Figures:
    """Compare answers with the truth."""
    told = list(frames)
    errors = np.array([abs(it.seen.ttc - it.ttc) / it.ttc if np.isfinite(it.ttc) else 0.0 for it in told])
    speeds = np.array([it.seen.closing_speed_interval or (np.nan, np.nan) for it in told])
    times = np.array([it.seen.ttc_interval or (np.nan, np.nan) for it in told])
    ttc, speed = np.array([it.ttc for it in told]), np.array([it.closing_speed for it in told])
    off = np.abs([it.seen.closing_speed for it in told] - speed)
    return Figures(
        len(told),
        np.quantile(errors, [0.5, 0.9, 1.0], method="higher"),
        float(np.mean((times[:, 0] <= ttc) & (ttc <= times[:, 1]))),
        float(np.mean((speeds[:, 0] <= speed) & (speed <= speeds[:, 1]))),
        float(np.nanmedian(speeds[:, 1] - speeds[:, 0]) / 2),
        float(np.nanquantile(off, 0.9)),
    )


def aligned(gate: ttc_fast.Gate) -> Any:
    """Return a new ``CloudTracker``."""
    return ttc_fast.CloudTracker(gate).update


def by_median(gate: ttc_fast.Gate) -> Any:
    """Return a new ``DistanceTracker`` of the median distance in a gate."""
    tracker, estimator = ttc_fast.DistanceTracker(), ttc_fast.Quantile(0.5)
    return lambda cloud, stamp: tracker.update(ttc_fast.robust_min_x(cloud, gate=gate, estimator=estimator).x, stamp)


def on_simulation(runs: Iterable[Sequence[lidar.Frame]], start: Any = aligned) -> Iterator[Frame]:
    """Let a new tracker see each run; frames count once it is warm and while the gap closes."""
    for run in runs:
        update = start(lidar.GATE)
        for number, frame in enumerate(run):
            seen = update(frame.points, frame.stamp)
            if number >= WARM and frame.closing_speed >= SLOWEST:
                yield Frame(seen, frame.ttc, frame.closing_speed)


def on_recording(gate: ttc_fast.Gate, start: Any = aligned) -> Iterator[Frame]:
    """Let a tracker see the recorded drive."""
    update = start(gate)
    for number, (cloud, (ttc, speed)) in enumerate(zip(recorded.clouds(), recorded.truths(), strict=True)):
        seen = update(cloud, number / recorded.RATE)
        if not np.isnan(ttc):
            yield Frame(seen, ttc, speed)


def on_distances(approaches: Iterable[tracking.Approach], method: Any = None) -> Iterator[Frame]:
    """Let a new ``DistanceTracker`` see each approach."""
    for approach in approaches:
        tracker = ttc_fast.DistanceTracker(method)
        truth = zip(approach.stamps, approach.measured, approach.closing_speed, approach.ttc, strict=True)
        for stamp, measured, speed, ttc in truth:
            seen = tracker.update(measured, stamp)
            if seen.status in tracking.JUDGED and seen.closing_speed_interval and not np.isnan(speed):
                yield Frame(seen, ttc, speed)


def held(approach: tracking.Approach, rate: float) -> tracking.Approach:
    """Return an approach whose sensor measures ``rate`` times a second, and says the newest distance in each row."""
    newest, due, rows = np.nan, -np.inf, []
    for stamp, measured in zip(approach.stamps, approach.measured, strict=True):
        if stamp >= due and not np.isnan(measured):
            newest, due = measured, stamp + 0.9 / rate
        rows.append(newest)
    return replace(approach, measured=np.array(rows))


def foreseen(approaches: Sequence[tracking.Approach]) -> list[list[str]]:
    """Return lines about what can be known of labelled speeds: how wide intervals must be that hold most of them."""
    tracks = []
    for approach in approaches:
        slopes = -np.diff(approach.measured) / np.diff(approach.stamps)
        newest = np.lib.stride_tricks.sliding_window_view(slopes, SLOPES)
        truth = approach.closing_speed[SLOPES:]
        known = ~np.isnan(truth) & ~np.isnan(newest).any(axis=1)
        tracks.append((newest[known], truth[known]))

    def errors(fitted: Iterable[int], judged: int) -> NDArray[np.float64]:
        seen, truth = (np.concatenate([tracks[i][part] for i in fitted]) for part in (0, 1))
        return np.asarray(tracks[judged][0] @ np.linalg.lstsq(seen, truth)[0] - tracks[judged][1])

    every = range(len(tracks))
    ways = {
        "the newest slope": [seen[:, -1] - truth for seen, truth in tracks],
        f"the best of {SLOPES} slopes, fitted to this truth": [errors(every, i) for i in every],
        f"the best of {SLOPES} slopes, fitted to the other tracks": [errors(set(every) - {i}, i) for i in every],
    }
    widths = {way: np.quantile(np.abs(np.concatenate(parts)), MOST) for way, parts in ways.items()}
    return [[way, f"{width:.2f}"] for way, width in widths.items()]


def bound(run: Sequence[lidar.Frame]) -> float:
    """Return the Cramér-Rao bound of the closing speed over the frames of a window, m/s.

    The ranges of points are all that is noisy.
    """
    counts = np.array([ttc_fast.robust_min_x(frame.points, gate=lidar.GATE).candidates for frame in run])
    stamps = np.array([frame.stamp for frame in run])
    apart = stamps - np.average(stamps, weights=counts)
    return float(lidar.Scanner().range_noise / np.sqrt(counts @ apart**2))


def over_bound(approach: lidar.Approach, seeds: int) -> float:
    """Return the standard error of the closing speed at steady motion over the Cramér-Rao bound of 1 s."""
    frames, ratios = 11, []
    for seed in range(seeds):
        run = approach.frames(seed)
        update = aligned(lidar.GATE)
        errors = [update(frame.points, frame.stamp).closing_speed - frame.closing_speed for frame in run]
        ratios += [errors[last] / bound(run[last + 1 - frames : last + 1]) for last in range(frames - 1, len(run), 3)]
    return float(np.sqrt(np.mean(np.square(ratios))))


def reports(seeds: int) -> list[Report]:
    """Make the tables; ``seeds`` is the number of simulated drives, and of runs of each approach."""
    rows = []
    if recorded.FOLDER.exists():
        for name, start in (("`CloudTracker`", aligned), ("`DistanceTracker` of the median", by_median)):
            for gate, kind in ((recorded.GATE, "`above_road`"), (recorded.CROP, "reflectivity crop")):
                rows.append(figures(on_recording(gate, start)).row(f"recorded, {kind}, {name}"))
    drives = [lidar.RoadDrive(seed).frames() for seed in range(seeds)]
    rows.append(figures(on_simulation(drives)).row("simulated road, `CloudTracker`"))
    rows.append(figures(on_simulation(drives, by_median)).row("simulated road, `DistanceTracker` of the median"))
    for kind, approaches in {"steady": lidar.STEADY, "changing": lidar.CHANGING}.items():
        runs = [each.frames(seed) for each in approaches for seed in range(max(seeds // 8, 1))]
        rows.append(figures(on_simulation(runs)).row(f"smooth, {kind}, `CloudTracker`"))
    labelled = [approach for _, approach in tracking.labelled()]
    for method in (None, ttc_fast.KalmanCA(), ttc_fast.KalmanCV()) if labelled else ():
        rows.append(figures(on_distances(labelled, method)).row(f"labelled tracks, {method or 'default'}"))
    for kind in tracking.KINDS:
        rarely_measured = [held(each, 10.0) for each in tracking.simulated(kind, 2 * seeds, rate=50.0)]
        rows.append(figures(on_distances(rarely_measured)).row(f"10 distances held in 50 rows a second, {kind}"))
    near = [each for each in (*lidar.STEADY, *lidar.STANDING) if each.distance <= 20]
    bounds = [[each.name, f"{over_bound(each, max(seeds // 8, 2)):.2f}"] for each in near]
    return [
        Report("Errors and intervals", LEGEND, HEADER, rows),
        *([Report("Labelled tracks", FORESEEN, ["from", "half-width, m/s"], foreseen(labelled))] if labelled else []),
        Report(
            "Standing",
            "Cars that stand behind standing cars.",
            ["what", "frames", "least TTC, s", "0 in the interval of the speed"],
            standing(seeds),
        ),
        Report(
            "Standard error over the bound of Cramér and Rao",
            "The closing speed at steady motion, from the frames of 1 s.",
            ["approach", "ratio"],
            bounds,
        ),
    ]


def standing(seeds: int) -> list[list[str]]:
    """Return lines about cars that stand behind cars."""
    runs = [each.frames(seed) for each in lidar.STANDING for seed in range(max(seeds // 8, 1))]
    seen = [update(it.points, it.stamp) for run in runs for update in [aligned(lidar.GATE)] for it in run]
    rows = [still("`CloudTracker`", seen)]
    for rate in (10.0, 25.0):
        frames = on_distances(tracking.standing(2 * seeds, rate))
        rows.append(still(f"`DistanceTracker`, {rate:g} frames a second", [it.seen for it in frames]))
    return rows


def still(name: str, seen: Sequence[ttc_fast.TrackedTTC]) -> list[str]:
    """Return a line about a gap that does not change."""
    ends = [it.closing_speed_interval for it in seen if it.closing_speed_interval is not None]
    share = np.mean([low <= 0.0 <= high for low, high in ends])
    return [name, str(len(ends)), f"{min(it.ttc for it in seen):.3g}", f"{100 * share:.0f} %"]


def main() -> None:
    """Print the tables, or put them where they belong."""
    parser = argparse.ArgumentParser(prog="python -m evaluation.intervals", description=__doc__)
    parser.add_argument("--markdown", type=Path, help="a document whose tables are replaced, such as docs/accuracy.md")
    parser.add_argument("--seeds", type=int, default=24, help="how many drives are simulated (%(default)s)")
    chosen = parser.parse_args()
    made = reports(chosen.seeds)
    if chosen.markdown is None:
        for report in made:
            console().print(report.rich())
    else:
        write_into(chosen.markdown, "python -m evaluation.intervals", "\n".join(it.markdown() for it in made))


if __name__ == "__main__":
    main()
