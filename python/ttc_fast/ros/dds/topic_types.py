"""Types of topics for Cyclone DDS, made from the definitions of the messages."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any

from cyclonedds.idl import make_idl_struct, types

from ttc_fast.ros.dds.definitions import DEFINITIONS, GID_OF_HUMBLE, HASHES

if TYPE_CHECKING:
    from collections.abc import Mapping

PRIMITIVES = {
    "bool": bool,
    "byte": types.byte,
    "char": types.uint8,  # of ROS 2, and not IDL's
    "uint8": types.uint8,
    "int32": types.int32,
    "uint32": types.uint32,
    "float32": types.float32,
    "float64": types.float64,
    "string": str,
}
# Their kinds are made as the program runs, which type checkers do not know.
ARRAY: Any = types.array
SEQUENCE: Any = types.sequence
BOUNDED_STRING: Any = types.bounded_str
FIELD = re.compile(r"(?P<type>[\w/]+)(?P<bound><=\d+)?(?P<many>\[\d*\])? (?P<name>\w+)")


def dds_name(name: str) -> str:
    """Return what a ROS type is called in DDS.

    Examples
    --------
    >>> from ttc_fast.ros.dds.topic_types import dds_name
    >>> dds_name("sensor_msgs/LaserScan")
    'sensor_msgs::msg::dds_::LaserScan_'
    """
    package, own = name.split("/")
    return f"{package}::msg::dds_::{own}_"


def type_hash(name: str, *, gid_size: int = 16) -> bytes:
    """Return what a ROS 2 endpoint says of its type in its user data; nothing where that release knew no hashes."""
    if gid_size != 16 and name.startswith("rmw_dds_common/"):
        return b""
    return f"typehash=RIHS01_{HASHES[name]};".encode()


@cache
def topic_type(name: str, *, gid_size: int = 16) -> Any:
    """Make the type of a topic. Its samples have all of a message as bytes, ``cdr``, and take that to be made.

    Cyclone is told all of the fields, so it refuses, on its way in, whatever does not fit them.
    """
    made = _struct(name, DEFINITIONS if gid_size == 16 else {**DEFINITIONS, **GID_OF_HUMBLE})
    # Cyclone hands bytes over, and neither builds nor reads objects.
    made.__init__ = _keep
    made.serialize = _kept
    made.deserialize = classmethod(_of)
    made.deserialize_key = classmethod(_of)
    return made


def _keep(sample: Any, cdr: bytes) -> None:
    sample.cdr = cdr


def _kept(sample: Any, **_: Any) -> Any:
    return sample.cdr


def _of(kind: Any, cdr: bytes) -> Any:
    return kind(cdr)


def _struct(name: str, definitions: Mapping[str, str]) -> Any:
    package, own = name.split("/")
    fields = {}
    for each in definitions[name].split("; "):
        field = FIELD.fullmatch(each)
        assert field is not None, each
        fields[field["name"]] = _field(package, field, definitions)
    # Cyclone puts :: for the dots.
    return make_idl_struct(f"{own}_", dds_name(name).replace("::", "."), fields, dataclassify=False)


def _field(package: str, field: re.Match[str], definitions: Mapping[str, str]) -> Any:
    kind = field["type"]
    one: Any
    if field["bound"]:
        one = BOUNDED_STRING[int(field["bound"][2:])]
    elif kind in PRIMITIVES:
        one = PRIMITIVES[kind]
    else:
        one = _struct(kind if "/" in kind else f"{package}/{kind}", definitions)
    if field["many"] is None:
        return one
    size = field["many"][1:-1]
    return ARRAY[one, int(size)] if size else SEQUENCE[one]
