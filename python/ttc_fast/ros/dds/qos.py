"""Qualities of service, as the profiles of ROS 2 have them [rmw, qos_profiles.h]."""

from __future__ import annotations

from cyclonedds.core import Policy, Qos
from cyclonedds.util import duration

PLAIN_CDR = Policy.DataRepresentation(use_cdrv0_representation=True)
"""XCDR1 alone, which is what ROS 2 speaks."""
PATIENCE = duration(milliseconds=100)
"""For how long a write may wait for slow readers. It does not have to: the oldest of those kept gives way."""

SENSOR_DATA = Qos(PLAIN_CDR, Policy.Reliability.BestEffort, Policy.History.KeepLast(5), Policy.Durability.Volatile)
"""For scans and clouds, where the next one is better than the last one again; publishers may be reliable or not."""
DEFAULT = Qos(
    PLAIN_CDR,
    Policy.Reliability.Reliable(PATIENCE),
    Policy.History.KeepLast(10),
    Policy.Durability.Volatile,
    Policy.WriterDataLifecycle(autodispose=False),
)
"""For all else."""
DISCOVERY = Qos(
    PLAIN_CDR,
    Policy.Reliability.Reliable(PATIENCE),
    Policy.History.KeepLast(1),
    Policy.Durability.TransientLocal,
    Policy.DurabilityService(0, Policy.History.KeepLast(1), -1, -1, -1),
    Policy.WriterDataLifecycle(autodispose=False),
)
"""For what a node says of itself: who comes later is told too."""


def with_user_data(qos: Qos, said: bytes) -> Qos:
    """Return the same, and what an entity says of itself."""
    return Qos(Policy.Userdata(said), base=qos)
