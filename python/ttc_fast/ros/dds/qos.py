"""Qualities of service: the profiles of ROS 2 [rmw, qos_profiles.h]."""

from __future__ import annotations

from cyclonedds.core import Policy, Qos
from cyclonedds.util import duration

PLAIN_CDR = Policy.DataRepresentation(use_cdrv0_representation=True)
"""ROS 2 uses XCDR1 alone."""
PATIENCE = duration(milliseconds=100)
"""The longest that a write may wait for a slow reader. It need not wait: the oldest sample that is kept gives way."""

SENSOR_DATA = Qos(PLAIN_CDR, Policy.Reliability.BestEffort, Policy.History.KeepLast(5), Policy.Durability.Volatile)
"""Scans and clouds use this: a lost one is not sent again. Publishers may be reliable or not."""
DEFAULT = Qos(
    PLAIN_CDR,
    Policy.Reliability.Reliable(PATIENCE),
    Policy.History.KeepLast(10),
    Policy.Durability.Volatile,
    Policy.WriterDataLifecycle(autodispose=False),
)
"""All other topics use this."""
LATCHED = Qos(
    PLAIN_CDR,
    Policy.Reliability.Reliable(PATIENCE),
    Policy.History.KeepLast(100),
    Policy.Durability.TransientLocal,
)
"""Static transforms use this: a reader that comes later receives what each publisher sent last."""
DISCOVERY = Qos(
    PLAIN_CDR,
    Policy.Reliability.Reliable(PATIENCE),
    Policy.History.KeepLast(1),
    Policy.Durability.TransientLocal,
    Policy.DurabilityService(0, Policy.History.KeepLast(1), -1, -1, -1),
    Policy.WriterDataLifecycle(autodispose=False),
)
"""The announcement of a node uses this: a participant that comes later receives it too."""


def with_user_data(qos: Qos, said: bytes) -> Qos:
    """Return the quality of service with user data."""
    return Qos(Policy.Userdata(said), base=qos)
