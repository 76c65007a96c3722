"""The node by itself and through each adapter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from tests.support.dds_harness import DdsHarness
from tests.support.ros_harness import AT_ONCE, CoreHarness, RclpyHarness, RospyHarness

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    Make = Callable[..., Any]


@pytest.fixture(params=["core", "rospy", "rclpy", "dds"])
def make(request: pytest.FixtureRequest) -> Iterator[Make]:
    """Make the node with some parameters."""
    with pytest.MonkeyPatch.context() as patch:
        kinds: dict[str, Make] = {
            "core": CoreHarness,
            "rospy": lambda **parameters: RospyHarness(patch, **parameters),
            "rclpy": lambda **parameters: RclpyHarness(patch, **parameters),
            "dds": lambda **parameters: DdsHarness(patch, **parameters),
        }
        made = []

        def make_one(**parameters: Any) -> Any:
            made.append(kinds[request.param](**{**AT_ONCE, **parameters}))
            return made[-1]

        yield make_one
        for each in made:
            each.close()
