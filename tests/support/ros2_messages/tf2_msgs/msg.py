"""TFMessage."""

from __future__ import annotations

from typing import Any

from composed_messages import Composed, Several, support
from geometry_msgs.msg import TransformStamped


class MetaclassTFMessage(Composed):  # type: ignore[misc] # found at run time only
    """The metaclass, which has the type support."""


class TFMessage(metaclass=MetaclassTFMessage):
    """The message."""

    __slots__ = ("transforms",)

    def __init__(self, transforms: Any = ()) -> None:
        self.transforms: list[TransformStamped] = list(transforms)

    @classmethod
    def of(cls, values: list[Any]) -> TFMessage:
        """Make a message of the values of its parts."""
        return cls(*values)


TRANSFORMS = Several(TransformStamped)
support(
    TFMessage,
    "tf2_msgs",
    "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    lambda message: [(TRANSFORMS, message and message.transforms)],
)
