"""None is no number: missing odometry must not read as straight ahead, in the kernels, the reference and the brake."""

from typing import Any

import numpy as np
import pytest

import ttc_fast
from tests.support.refusals import refused
from ttc_fast import reference

RANGES, POINTS = np.full(21, 5.0), np.array([[5.0, 0.0], [6.0, 1.0]])
OUTLINE = (-0.5, 0.5, -0.4, 0.4)


@pytest.mark.parametrize("argument", ["yaw_rate", "lateral_speed"])
@pytest.mark.parametrize("module", [ttc_fast, reference])
def test_a_motion_without_a_number_is_refused_by_name(module: Any, argument: str) -> None:
    scan = module.ScanTTC(-1.0, 0.1, 21, outline=OUTLINE)
    path, swept = module.SweptPath(OUTLINE), module.ScanSweptPath(scan)
    calls = [scan.min, scan.nearest, scan.per_beam, swept.min, swept.nearest, swept.per_beam]
    for data, methods in ((RANGES, calls), (POINTS, [path.min, path.nearest, path.per_point])):
        for call in methods:
            assert refused(TypeError, f"{argument} must be a number, got No", call, data, 2.0, **{argument: None})
            call(data, 2.0, **{argument: 0.0})
    refused(TypeError, f"{argument} must be a number, got No", swept.unseen, 2.0, ahead=0.3, **{argument: None})
    if argument == "yaw_rate":
        refused(TypeError, "yaw_rate must be a number, got No", module.RangeRate(scan).update, RANGES, 0.0, None)


@pytest.mark.parametrize("field", ["speed", "yaw_rate", "lateral_speed"])
def test_odometry_without_a_number_is_refused_by_the_brake(field: str) -> None:
    controller = ttc_fast.BrakeController(scan=ttc_fast.ScanTTC(-1.0, 0.1, 21))
    motion: Any = ttc_fast.Motion(2.0)
    motion = motion._replace(**{field: None})
    refused(
        TypeError, f"motion.{field} must be a number", controller.update, 1.0, ranges=RANGES, stamp=1.0, motion=motion
    )
