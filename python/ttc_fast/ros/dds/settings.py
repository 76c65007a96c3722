"""Settings that only a participant in DDS has."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ttc_fast._settings import Count, Text, check_fields, hint, setting, settings_of
from ttc_fast.ros.dds.names import check_node

if TYPE_CHECKING:
    from collections.abc import Mapping

DOMAINS = 232
"""The highest domain whose ports are not above 65535 [RTPS 2.5, 9.6.2.3]."""


class DdsSettingError(ValueError):
    """A setting that cannot be used: which, what is wrong with it, and what would be right."""


@dataclass(frozen=True)
class DdsSettings:
    """Settings that only a participant in DDS has; the variable CYCLONEDDS_URI has all others of the network.

    The fields describe themselves.

    Raises
    ------
    DdsSettingError, NameNotAllowedError
        If a setting is out of range, or ROS 2 does not allow a name.
    TypeError
        If a setting is of the wrong type.

    Examples
    --------
    >>> from ttc_fast.ros.dds.settings import DdsSettings
    >>> DdsSettings(domain_id=3, gid_size=24).domain
    3
    """

    domain_id: int | None = setting(None, Count(most=DOMAINS), "The domain. None is the variable ROS_DOMAIN_ID, or 0.")
    node_name: str = setting("ttc_fast", Text(), "The name that ros2 node list shows.")
    namespace: str = setting("/", Text(), "The namespace of the node, and of topics without a / in front.")
    gid_size: int = setting(
        16,
        Count(unit="bytes"),
        "The size of a Gid: 16 from ROS 2 Iron on, 24 up to Humble. With the wrong one, ros2 node list has no name.",
    )
    enclave: str = setting("/", Text(), "The enclave of SROS 2; / is none.")

    def __post_init__(self) -> None:
        try:
            check_fields(self)
        except ValueError as error:
            raise DdsSettingError(str(error)) from None
        check_node(self.node_name, self.namespace)
        if self.gid_size not in (16, 24):
            raise DdsSettingError(f"gid_size is 16 from ROS 2 Iron on and 24 up to Humble, got {self.gid_size!r}")
        if not self.enclave.startswith("/") or set(";=") & set(self.enclave):
            raise DdsSettingError(f"enclave begins with / and has no ; or = in it, got {self.enclave!r}")
        if not 0 <= self.domain <= DOMAINS:
            raise DdsSettingError(f"domain_id must be from 0 to {DOMAINS}, got {self.domain}")

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> DdsSettings:
        """Make settings from the table [dds] of a file."""
        by_name = {each.name: each for each in settings_of(cls)}
        for name in table:
            if name not in by_name:
                raise DdsSettingError(f"there is no setting {name!r}: {hint(str(name), by_name)}")
        return cls(**{name: by_name[name].read(value) for name, value in table.items()})

    @property
    def domain(self) -> int:
        """The DDS domain, which is the ROS domain as well."""
        if self.domain_id is not None:
            return self.domain_id
        given = os.environ.get("ROS_DOMAIN_ID", "") or "0"
        if not given.isdecimal():
            raise DdsSettingError(f"the variable ROS_DOMAIN_ID must be a number from 0 to {DOMAINS}, got {given!r}")
        return int(given)
