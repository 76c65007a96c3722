"""Every call that is timed, by domain: pytest-benchmark, ``benches.report`` and ``benches.goals`` read this list."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from benches import brake, camera, clouds, paths, scans, street, tracks

if TYPE_CHECKING:
    from benches.case import Case


class Domain(NamedTuple):
    """Cases that stand in one table."""

    title: str
    legend: str
    cases: list[Case]


DOMAINS = (
    Domain(
        "Scans",
        "NumPy and numba have tables made once. numba: the loop of the F1TENTH gym's collision check, giving the least "
        "time and, for nearest, its beam.",
        scans.CASES,
    ),
    Domain(
        "Range rates",
        "One scan after the other, each with its stamp, a room seen by a car that stands.",
        scans.RATE_CASES,
    ),
    Domain("Clouds", f"Clouds: {street.SOURCE}. C++: one pass, then nth_element.", clouds.CASES),
    Domain("Followed bodies", "Each is a drive of 20 frames, followed by a new tracker or only gated.", clouds.TRACKED),
    Domain(
        "Swept paths",
        "The scans above, as points or as they are. NumPy: arc tangents of all points, without their checks.",
        paths.CASES,
    ),
    Domain(
        "Trackers",
        "Each is a tracker made and fed a hundred distances. NumPy: polyfit over the window, and no more.",
        tracks.CASES,
    ),
    Domain("Camera", f"Matches: {camera.SOURCE}.", camera.CASES),
    Domain("Decisions", "The default controller beside ScanSweptPath.nearest on the same scans.", brake.CASES),
)
CASES = [case for domain in DOMAINS for case in domain.cases]
BY_NAME = {str(case): case for case in CASES}
assert len(BY_NAME) == len(CASES), "two cases have the same name"
