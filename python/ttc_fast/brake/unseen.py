"""Whether the sensors look at the path of the vehicle: what nothing looks at is not clear.

Where a scanner looks follows from its mount, its angles and its mask. Where a cloud looks follows from the ``views``
that the user gave. Without them, a cloud looks along the path if it has a point there: a range finder at the rear has
one behind the vehicle, a camera at the front has none. A sensor whose newest data are too old looks nowhere.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ttc_fast._core import ScanSweptPath, ScanTTC
from ttc_fast.brake.criteria import StoppingDistance

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ttc_fast.brake.settings import BrakeSettings
    from ttc_fast.brake.state import ControllerState
    from ttc_fast.brake.threats import Frame, ThreatAssessment
    from ttc_fast.brake.types import Criterion, Motion

NARROW = 0.1
"""An unseen strip of the path may be this wide, m, and a third of the shorter side of the outline: nobody fits in."""
THIRD = 1.0 / 3.0
SEEN = False, None
"""All of the path is seen."""
PROBE = 1e4
"""At this speed the path of a straight motion is as long as any sensor sees, m/s."""


class FieldsOfView:
    """The fields of view of the sensors of a controller.

    Parameters
    ----------
    assessment : ThreatAssessment
        The kernels of the controller.
    views
        An argument of ``BrakeController``.
    settings : BrakeSettings
        The settings of the controller.
    criteria : iterable of criteria
        The criteria, of which ``StoppingDistance`` says how long it takes to stop.
    """

    def __init__(
        self, assessment: ThreatAssessment, views: Any, settings: BrakeSettings, criteria: Iterable[Criterion]
    ) -> None:
        self.views = tuple(views)
        for view in self.views:
            if not isinstance(view, ScanTTC):
                raise TypeError(f"views must be ScanTTC objects, got {type(view).__name__}")
        if self.views and assessment.path is None:
            raise ValueError("views need a path: they say where its points were measured from")
        self._assessment = assessment
        self._views = [ScanSweptPath(view) for view in self.views]
        self._slow = max(settings.creep_speed, settings.standstill_speed)
        self._timeout = settings.sensor_timeout
        stopping = next((each for each in criteria if isinstance(each, StoppingDistance)), None)
        stopping = stopping or StoppingDistance(deceleration=settings.deceleration)
        self._reaction_time, self._deceleration = stopping.reaction_time, stopping.deceleration
        self._narrow = NARROW if assessment.outline is None else widest_unseen(assessment.outline)

    def unseen(self, frame: Frame, state: ControllerState, motion: Motion | None) -> tuple[bool, int | None]:
        """Return whether nothing looks at a part of the path, and the edge that a cloud turned out to look at."""
        scan_path, views = self._assessment.scan_path, self._views
        if motion is None or not (scan_path is not None or views):
            return SEEN
        speed, yaw_rate, lateral_speed, _ = motion
        over_ground = math.hypot(speed, lateral_speed)
        if over_ground <= self._slow:
            return SEEN
        ahead = self._reaction_time + over_ground / (2.0 * self._deceleration)
        if (  # by far the most frequent case
            frame.ranges is not None
            and scan_path is not None
            and not views
            and scan_path.unseen(speed, yaw_rate, lateral_speed, ahead=ahead) <= self._narrow
        ):
            return SEEN
        oldest = frame.now - self._timeout
        has_cloud = frame.points is not None or state.cloud_at >= oldest
        looks: list[ScanSweptPath] = []
        if scan_path is not None and (frame.ranges is not None or state.scan_at >= oldest):
            looks = [scan_path]
        if views and has_cloud:
            looks += views
        if looks:
            first, *others = looks
            if first.unseen(speed, yaw_rate, lateral_speed, ahead=ahead, others=others) <= self._narrow:
                return False, None
        if views or not has_cloud:
            return True, None
        edge = leading_edge(speed, lateral_speed)
        if frame.points is not None and self._finds_point(frame.points, speed, lateral_speed):
            return False, edge
        return state.cloud_looks.get(edge, -math.inf) < oldest, None

    def _finds_point(self, points: Any, speed: float, lateral_speed: float) -> bool:
        """Return whether a cloud has a point straight ahead of the edge that leads."""
        path = self._assessment.path
        if path is None:
            return False
        if abs(speed) >= abs(lateral_speed):
            seen: Any = path.nearest(points, math.copysign(PROBE, speed))
        else:
            seen = path.nearest(points, 0.0, 0.0, math.copysign(PROBE, lateral_speed))
        return bool(seen.ttc < math.inf)


def widest_unseen(outline: tuple[float, float, float, float]) -> float:
    """Return how wide an unseen strip of the path of an outline may be, m."""
    x_rear, x_front, y_right, y_left = outline
    return float(min(NARROW, (x_front - x_rear) * THIRD, (y_left - y_right) * THIRD))


def leading_edge(speed: float, lateral_speed: float) -> int:
    """Return the edge of the outline that leads: 0 the front, 1 the rear, 2 the left, 3 the right."""
    if abs(speed) >= abs(lateral_speed):
        return 0 if speed > 0.0 else 1
    return 2 if lateral_speed > 0.0 else 3
