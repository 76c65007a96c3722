"""Whether the sensors look at the path of the vehicle: what nothing looks at is not clear.

Where a scanner looks follows from its mount, its angles and its mask. Where a cloud looks follows from the ``views``
that the user gave. Without them, a cloud looks along the path if it has a point there: a range finder at the rear has
one behind the vehicle, a camera at the front has none. Clouds that come without a scan are taken to look ahead, where
nothing may be for a long time. A sensor whose newest data are too old looks nowhere.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ttc_fast._core import ScanSweptPath, ScanTTC

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ttc_fast.brake.frame import Frame
    from ttc_fast.brake.settings import BrakeSettings
    from ttc_fast.brake.state import ControllerState
    from ttc_fast.brake.threats import ThreatAssessment
    from ttc_fast.brake.types import Motion

NARROW = 0.1
"""An unseen strip of the path may be this wide, m, and a third of the shorter side of the outline: nobody fits in."""
THIRD = 1.0 / 3.0
FRONT = 0
"""The number of the edge of the outline that leads when the vehicle drives forward."""
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

    Attributes
    ----------
    state : ControllerState
        What the controller remembers.
    others : sequence of FieldsOfView
        The fields of view of other controllers of the vehicle.
    """

    state: ControllerState
    others: Sequence[FieldsOfView] = ()

    def __init__(self, assessment: ThreatAssessment, views: Any, settings: BrakeSettings) -> None:
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
        self._reaction_time = assessment.stopping.reaction_time
        self._twice_deceleration = 2.0 * assessment.stopping.deceleration
        self._narrow = NARROW if assessment.outline is None else widest_unseen(assessment.outline)
        by_cloud = assessment.scan is None and assessment.path is not None
        self._is_judged = assessment.scan_path is not None or bool(self._views) or by_cloud

    def unseen(self, frame: Frame, motion: Motion | None, alone: bool = False) -> bool:
        """Return whether nothing looks at a part of the path; ``alone`` leaves the other controllers out.

        The edge of the outline that a cloud turns out to look at is added to those of the frame.
        """
        if motion is None or not self._is_judged:
            return False
        speed, yaw_rate, lateral_speed, _ = motion
        over_ground = math.hypot(speed, lateral_speed)
        if over_ground <= self._slow:
            return False
        ahead = self._reaction_time + over_ground / self._twice_deceleration
        oldest, by_scan = frame.now - self._timeout, self._assessment.scan_path
        if (  # by far the most frequent case
            by_scan is not None
            and (not frame.is_cloud or self.state.scans.seen_at >= oldest)
            and by_scan.unseen(speed, yaw_rate, lateral_speed, ahead=ahead) <= self._narrow
        ):
            return False
        looks: list[ScanSweptPath] = []
        clouds: list[FieldsOfView] = []
        for fields in (self,) if alone else (self, *self.others):
            mine, by_scan, state = fields is self, fields._assessment.scan_path, fields.state
            if by_scan is not None and (state.scans.seen_at >= oldest or (mine and not frame.is_cloud)):
                looks.append(by_scan)
            if state.clouds.seen_at >= oldest or (mine and frame.is_cloud):
                looks += fields._views
                clouds += [] if fields._views else [fields]
        if looks:
            first, *more = looks
            if first.unseen(speed, yaw_rate, lateral_speed, ahead=ahead, others=more) <= self._narrow:
                return False
        edge = leading_edge(speed, lateral_speed)
        for fields in clouds:
            if fields is self and frame.is_cloud:
                if edge == FRONT and self._assessment.scan is None:
                    return False
                if self._finds_point(frame.readings, speed, lateral_speed):
                    frame.looks = (*frame.looks, edge)
                    return False
            if fields.state.cloud_looks.get(edge, -math.inf) >= oldest:
                return False
        return True

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
