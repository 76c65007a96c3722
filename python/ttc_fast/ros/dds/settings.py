"""Settings that only a participant in DDS has."""

from __future__ import annotations

import os
from dataclasses import dataclass

from ttc_fast.ros.dds.names import check_node

DOMAINS = 232
"""The highest domain whose ports are not above 65535 [RTPS 2.5, 9.6.2.3]."""


class DdsSettingError(ValueError):
    """A setting that cannot be used: which, what is wrong with it, and what would be right."""


@dataclass(frozen=True)
class DdsSettings:
    """Settings that only a participant in DDS has. All else of the network is Cyclone's: the variable CYCLONEDDS_URI.

    Attributes
    ----------
    domain_id : int or None
        0 to 232; None is the variable ROS_DOMAIN_ID, or 0.
    node_name, namespace : str
        What ``ros2 node list`` shows; topics without a / in front are in the namespace.
    gid_size : int
        Of the sample on ros_discovery_info: 16 bytes from ROS 2 Iron on, 24 up to Humble. With the wrong one nothing is
        lost but the name in ``ros2 node list``.
    enclave : str
        Of SROS 2; "/" is none.

    Raises
    ------
    DdsSettingError, NameNotAllowedError
        If one is out of range, or ROS 2 does not allow a name.

    Examples
    --------
    >>> from ttc_fast.ros.dds.settings import DdsSettings
    >>> DdsSettings(domain_id=3, gid_size=24).domain
    3
    """

    domain_id: int | None = None
    node_name: str = "ttc_fast"
    namespace: str = "/"
    gid_size: int = 16
    enclave: str = "/"

    def __post_init__(self) -> None:
        check_node(self.node_name, self.namespace)
        if self.gid_size not in (16, 24):
            raise DdsSettingError(f"gid_size is 16 from ROS 2 Iron on and 24 up to Humble, got {self.gid_size!r}")
        if not self.enclave.startswith("/") or set(";=") & set(self.enclave):
            raise DdsSettingError(f"enclave begins with / and has no ; or = in it, got {self.enclave!r}")
        if not 0 <= self.domain <= DOMAINS:
            raise DdsSettingError(f"domain_id must be from 0 to {DOMAINS}, got {self.domain}")

    @property
    def domain(self) -> int:
        """The DDS domain, which is ROS's too."""
        if self.domain_id is not None:
            return self.domain_id
        given = os.environ.get("ROS_DOMAIN_ID", "") or "0"
        if not given.isdecimal():
            raise DdsSettingError(f"the variable ROS_DOMAIN_ID must be a number from 0 to {DOMAINS}, got {given!r}")
        return int(given)
