"""AckermannDriveStamped, and its part."""

from __future__ import annotations

from typing import Any

from composed_messages import Composed, Header, Part, support
from std_msgs.msg import Float32

FIELDS = ("steering_angle", "steering_angle_velocity", "speed", "acceleration", "jerk")


class AckermannDrive:
    """The drive, each field of which takes a float alone, as in the real message."""

    __slots__ = FIELDS

    def __init__(self, **values: float) -> None:
        for name in FIELDS:
            setattr(self, name, values.get(name, 0.0))

    def __setattr__(self, name: str, value: float) -> None:
        assert isinstance(value, float), f"the field {name} must be of type float, got {value!r}"
        object.__setattr__(self, name, value)


class MetaclassAckermannDriveStamped(Composed):  # type: ignore[misc] # found at run time only
    """The metaclass, which has the type support."""


class AckermannDriveStamped(metaclass=MetaclassAckermannDriveStamped):
    """The message."""

    __slots__ = ("drive", "header")

    def __init__(self, header: Header | None = None, drive: AckermannDrive | None = None) -> None:
        self.header, self.drive = header or Header(), drive or AckermannDrive()

    @classmethod
    def of(cls, values: list[Any]) -> AckermannDriveStamped:
        """Make a message of the values of its parts."""
        header, *drive = values
        return cls(header, AckermannDrive(**{name: value.data for name, value in zip(FIELDS, drive, strict=True)}))


HEADER, NUMBER = Part(Header), Part(Float32)
support(
    AckermannDriveStamped,
    "ackermann_msgs",
    "48ca7612a08d3bb72744fd98b71b7cf2ea24c6ad50fa4e1aa0bbad963c90d8cf",
    lambda message: [
        (HEADER, message and message.header),
        *((NUMBER, message and Float32(data=getattr(message.drive, name))) for name in FIELDS),
    ],
)
