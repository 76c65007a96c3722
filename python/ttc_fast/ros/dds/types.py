"""Types of messages for Cyclone DDS, made from the definitions of ROS.

A message that is sent is an object of Cyclone's own ``IdlStruct`` (``message``), which Cyclone serialises. A message
that is received stays as its bytes, which ``ttc_fast.ros_messages`` views in place: a scan of 1080 beams takes 2 us so,
and 34 us as an object. Either way Cyclone knows all of the fields, and refuses bytes that do not fit them.
"""

from __future__ import annotations

import re
from functools import cache, partial
from typing import TYPE_CHECKING, Any

from cyclonedds.idl import make_idl_struct, types

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

DEFINITIONS = {
    "builtin_interfaces/Time": "int32 sec; uint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec; uint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp; string frame_id",
    "std_msgs/Bool": "bool data",
    "std_msgs/Float32": "float32 data",
    "std_msgs/Float64": "float64 data",
    "std_msgs/ColorRGBA": "float32 r; float32 g; float32 b; float32 a",
    "geometry_msgs/Point": "float64 x; float64 y; float64 z",
    "geometry_msgs/Vector3": "float64 x; float64 y; float64 z",
    "geometry_msgs/Quaternion": "float64 x; float64 y; float64 z; float64 w",
    "geometry_msgs/Pose": "Point position; Quaternion orientation",
    "geometry_msgs/PoseWithCovariance": "Pose pose; float64[36] covariance",
    "geometry_msgs/Twist": "Vector3 linear; Vector3 angular",
    "geometry_msgs/TwistWithCovariance": "Twist twist; float64[36] covariance",
    "geometry_msgs/Transform": "Vector3 translation; Quaternion rotation",
    "geometry_msgs/TransformStamped": "std_msgs/Header header; string child_frame_id; Transform transform",
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "nav_msgs/Odometry": (
        "std_msgs/Header header; string child_frame_id; geometry_msgs/PoseWithCovariance pose; "
        "geometry_msgs/TwistWithCovariance twist"
    ),
    "sensor_msgs/LaserScan": (
        "std_msgs/Header header; float32 angle_min; float32 angle_max; float32 angle_increment; "
        "float32 time_increment; float32 scan_time; float32 range_min; float32 range_max; float32[] ranges; "
        "float32[] intensities"
    ),
    "sensor_msgs/Joy": "std_msgs/Header header; float32[] axes; int32[] buttons",
    "sensor_msgs/PointField": "string name; uint32 offset; uint8 datatype; uint32 count",
    "sensor_msgs/PointCloud2": (
        "std_msgs/Header header; uint32 height; uint32 width; PointField[] fields; bool is_bigendian; "
        "uint32 point_step; uint32 row_step; uint8[] data; bool is_dense"
    ),
    "sensor_msgs/CompressedImage": "std_msgs/Header header; string format; uint8[] data",
    "ackermann_msgs/AckermannDrive": (
        "float32 steering_angle; float32 steering_angle_velocity; float32 speed; float32 acceleration; float32 jerk"
    ),
    "ackermann_msgs/AckermannDriveStamped": "std_msgs/Header header; AckermannDrive drive",
    "diagnostic_msgs/KeyValue": "string key; string value",
    "diagnostic_msgs/DiagnosticStatus": (
        "byte level; string name; string message; string hardware_id; KeyValue[] values"
    ),
    "diagnostic_msgs/DiagnosticArray": "std_msgs/Header header; DiagnosticStatus[] status",
    "visualization_msgs/UVCoordinate": "float32 u; float32 v",
    "visualization_msgs/MeshFile": "string filename; uint8[] data",
    "visualization_msgs/Marker": (
        "std_msgs/Header header; string ns; int32 id; int32 type; int32 action; geometry_msgs/Pose pose; "
        "geometry_msgs/Vector3 scale; std_msgs/ColorRGBA color; builtin_interfaces/Duration lifetime; "
        "bool frame_locked; geometry_msgs/Point[] points; std_msgs/ColorRGBA[] colors; string texture_resource; "
        "sensor_msgs/CompressedImage texture; UVCoordinate[] uv_coordinates; string text; string mesh_resource; "
        "MeshFile mesh_file; bool mesh_use_embedded_materials"
    ),
    "rmw_dds_common/Gid": "char[16] data",
    "rmw_dds_common/NodeEntitiesInfo": (
        "string<=256 node_namespace; string<=256 node_name; Gid[] reader_gid_seq; Gid[] writer_gid_seq"
    ),
    "rmw_dds_common/ParticipantEntitiesInfo": "Gid gid; NodeEntitiesInfo[] node_entities_info_seq",
}
"""Type and name of each field, by the name of the message, in the words of the ``.msg`` files.

Comments and constants are left out. A type without a package is of the same one [common_interfaces, ackermann_msgs and
rmw_dds_common, Humble to Jazzy].
"""

GID_OF_HUMBLE = {"rmw_dds_common/Gid": "char[24] data"}
"""Up to ROS 2 Humble a Gid had 24 bytes; from Iron on it has 16."""

HASHES = {
    "geometry_msgs/Twist": "9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
    "nav_msgs/Odometry": "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    "sensor_msgs/Joy": "0d356c79cad3401e35ffeb75a96a96e08be3ef896b8b83841d73e890989372c5",
    "sensor_msgs/LaserScan": "64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828",
    "sensor_msgs/PointCloud2": "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5",
    "tf2_msgs/TFMessage": "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    "std_msgs/Bool": "feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9",
    "std_msgs/Float32": "7170d3d8f841f7be3172ce5f4f59f3a4d7f63b0447e8b33327601ad64d83d6e2",
    "std_msgs/Float64": "705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a",
    "ackermann_msgs/AckermannDriveStamped": "48ca7612a08d3bb72744fd98b71b7cf2ea24c6ad50fa4e1aa0bbad963c90d8cf",
    "diagnostic_msgs/DiagnosticArray": "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    "visualization_msgs/Marker": "45b13ccf791f225962bf74e746f9644518855d783a6f42ba0cc14fde2b4f3ce0",
    "rmw_dds_common/ParticipantEntitiesInfo": "e725f4a506958c79f95dd693b965722c57b19cd18e7eff984f49561b93dc985d",
}
"""Hashes of version 1 (RIHS01), as ``rosbags`` computes it from the definitions."""
PRIMITIVES: dict[str, tuple[Any, Callable[[], Any]]] = {
    "bool": (bool, bool),
    "byte": (types.byte, int),
    "char": (types.uint8, int),  # the char of ROS 2, which is not that of IDL
    "uint8": (types.uint8, int),
    "int32": (types.int32, int),
    "uint32": (types.uint32, int),
    "float32": (types.float32, float),
    "float64": (types.float64, float),
    "string": (str, str),
}
"""The types of Cyclone and of Python for each type of ROS."""
# Their kinds are made as the program runs, which type checkers do not know.
ARRAY: Any = types.array
SEQUENCE: Any = types.sequence
BOUNDED_STRING: Any = types.bounded_str
FIELD = re.compile(r"(?P<type>[\w/]+)(?P<bound><=\d+)?(?P<many>\[\d*\])? (?P<name>\w+)")


def dds_name(name: str) -> str:
    """Return the name of a ROS type in DDS.

    Examples
    --------
    >>> from ttc_fast.ros.dds.types import dds_name
    >>> dds_name("sensor_msgs/LaserScan")
    'sensor_msgs::msg::dds_::LaserScan_'
    """
    package, own = name.split("/")
    return f"{package}::msg::dds_::{own}_"


def type_hash(name: str, *, gid_size: int = 16) -> bytes:
    """Return the user data by which a ROS 2 endpoint tells its type; empty where that release knew no hashes."""
    if gid_size != 16 and name.startswith("rmw_dds_common/"):
        return b""
    return f"typehash=RIHS01_{HASHES[name]};".encode()


def message(name: str, /, *, gid_size: int = 16, **values: Any) -> Any:
    r"""Make a message that can be sent; a field that is not given is zero or empty.

    Examples
    --------
    >>> from ttc_fast.ros.dds.types import message, serialized
    >>> pair = message("diagnostic_msgs/KeyValue", key="reason")
    >>> pair.value = "STALE"
    >>> serialized(pair)[8:15]
    b'reason\x00'
    """
    kind, makers = message_type(name, gid_size=gid_size)
    return kind(**{own: make() for own, make in makers.items() if own not in values}, **values)


def time_of(nanoseconds: int) -> Any:
    """Make a builtin_interfaces/Time."""
    seconds, rest = divmod(nanoseconds, 1_000_000_000)
    return message("builtin_interfaces/Time", sec=seconds, nanosec=rest)


def serialized(sent: Any) -> bytes:
    """Return the bytes of a message: XCDR1, as ROS 2 has it."""
    cdr: bytes = sent.serialize(use_version_2=False)
    return cdr


@cache
def message_type(name: str, *, gid_size: int = 16) -> tuple[Any, Mapping[str, Callable[[], Any]]]:
    """Return the type of a message, and for each field what makes it empty."""
    parsed = {field["name"]: _field(name, field, gid_size) for field in fields_of(name, gid_size=gid_size)}
    kind = make_idl_struct(*_names(name), {own: idl_type for own, (idl_type, _) in parsed.items()})
    return kind, {own: make for own, (_, make) in parsed.items()}


@cache
def topic_type(name: str, *, gid_size: int = 16) -> Any:
    """Return the type of a topic, whose samples hold all of a message as bytes: ``cdr``. It is made from these.

    Cyclone knows all of the fields, but hands over the bytes, and neither makes nor reads objects.
    """
    fields = {field["name"]: _field(name, field, gid_size)[0] for field in fields_of(name, gid_size=gid_size)}
    made: Any = make_idl_struct(*_names(name), fields, dataclassify=False)
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


def fields_of(name: str, *, gid_size: int = 16) -> list[re.Match[str]]:
    """Parse the definition of a message into its fields."""
    definitions = DEFINITIONS if gid_size == 16 else {**DEFINITIONS, **GID_OF_HUMBLE}
    found = [FIELD.fullmatch(each) for each in definitions[name].split("; ")]
    assert all(found), definitions[name]
    return [field for field in found if field is not None]


def _names(name: str) -> tuple[str, str]:
    """Return the name of the class, and that of the type, in which Cyclone puts :: for the dots."""
    return f"{name.partition('/')[2]}_", dds_name(name).replace("::", ".")


def _field(owner: str, field: re.Match[str], gid_size: int) -> tuple[Any, Callable[[], Any]]:
    """Return the type of a field, and what makes it empty."""
    kind = field["type"]
    one: Any
    empty: Callable[[], Any]
    if field["bound"]:
        one, empty = BOUNDED_STRING[int(field["bound"][2:])], str
    elif kind in PRIMITIVES:
        one, empty = PRIMITIVES[kind]
    else:
        nested = kind if "/" in kind else f"{owner.partition('/')[0]}/{kind}"
        one, empty = message_type(nested, gid_size=gid_size)[0], partial(message, nested, gid_size=gid_size)
    if field["many"] is None:
        return one, empty
    size = field["many"][1:-1]
    return (ARRAY[one, int(size)], lambda: [empty() for _ in range(int(size))]) if size else (SEQUENCE[one], list)
