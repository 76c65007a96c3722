"""Every call that is timed, by domain: pytest-benchmark, ``benches.report`` and ``benches.goals`` read this list."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from benches import brake, camera, clouds, paths, scans, street, tracks

if TYPE_CHECKING:
    from benches.case import Case


class Domain(NamedTuple):
    """Cases that stand in one table."""

    title: str
    cases: list[Case]
    legend: str


DOMAINS = [
    Domain("Scans", scans.CASES, "NumPy and numba have tables made once. numba: the loop of the F1TENTH gym's check."),
    Domain("Range rates", scans.RATE_CASES, "One scan of a room after the other, with its stamp; the car stands."),
    Domain("Clouds", clouds.CASES, f"Clouds: {street.SOURCE}. C++: one pass, then nth_element."),
    Domain("Followed bodies", clouds.TRACKED, "A drive of 20 frames, followed by a new tracker or only gated."),
    Domain("Swept paths", paths.CASES, "The scans above. NumPy: arc tangents of all points, without their checks."),
    Domain("Trackers", tracks.CASES, "A tracker made and fed a hundred distances. NumPy: polyfit over the window."),
    Domain("Camera", camera.CASES, f"Matches: {camera.SOURCE}."),
    Domain("Decisions", brake.CASES, "The default controller beside nearest and unseen of its swept paths."),
]
CASES = [case for domain in DOMAINS for case in domain.cases]
BY_NAME = {str(case): case for case in CASES}
assert len(BY_NAME) == len(CASES), "two cases have the same name"
