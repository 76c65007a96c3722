"""sensor_msgs/PointCloud2 as a record array over the bytes of the message, without ROS and without a copy.

Every cloud passes here, whether a bag, DDS, rospy or rclpy brings it. Drivers fill these messages in many ways: they
leave ``row_step`` as it was before the cloud was cropped, declare padding as fields, or write a ``count`` of 0. Two
things must be certain: where the points lie in the data, and which bytes of each point are x, y and z. A message that
leaves one of them open is refused in one sentence. Anything else that is wrong is an oddity: it is read in the one way
that is left, or ignored, and ``read_pointcloud2`` says so beside the points, for its caller to count and to show.
"""

from __future__ import annotations

import operator
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ttc_fast._core import NoDataError

if TYPE_CHECKING:
    from numpy.typing import NDArray

DATATYPES = {
    1: ("INT8", "i1"),
    2: ("UINT8", "u1"),
    3: ("INT16", "i2"),
    4: ("UINT16", "u2"),
    5: ("INT32", "i4"),
    6: ("UINT32", "u4"),
    7: ("FLOAT32", "f4"),
    8: ("FLOAT64", "f8"),
}
"""Name in sensor_msgs/PointField and dtype, by datatype."""
FLOATS = (7, 8)
COORDINATES = ("x", "y", "z")
MOST_BYTES = 2**31 - 1
"""NumPy has no wider records."""
NO_POINTS = np.empty(0, [(name, "<f4") for name in (*COORDINATES, "intensity")])
"""The points of a message without points."""


class _Field(NamedTuple):
    """A PointField."""

    name: str
    offset: int
    datatype: int
    numbers: int
    """Its ``count``: how many there are in each point."""

    @property
    def size(self) -> int:
        """Its bytes, if its datatype is known."""
        return self.numbers * np.dtype(DATATYPES[self.datatype][1]).itemsize

    @property
    def end(self) -> int:
        """The byte after its last one."""
        return self.offset + self.size

    def overlaps(self, other: _Field) -> bool:
        """Whether the two share bytes."""
        return self.offset < other.end and other.offset < self.end


class _Layout(NamedTuple):
    """Where the fields lie in a point, and what is odd about them."""

    records: np.dtype[np.void]
    little_endian: np.dtype[np.void] | None
    """What to convert the records to, if the kernels cannot read them as they are."""
    oddities: dict[str, str]


def from_pointcloud2(msg: Any, *, intensity: str | None = "intensity") -> NDArray[np.void]:
    """View the points of a PointCloud2 message as a record array, which ``robust_min_x`` reads in place.

    Parameters
    ----------
    msg : sensor_msgs/PointCloud2, of ROS 1, ROS 2 or anything with the same fields
        The message. Its ``height``, ``width``, ``fields``, ``is_bigendian``, ``point_step``, ``row_step`` and ``data``
        are read; ``data`` may be bytes, an array.array, an ndarray of bytes or any other contiguous buffer of bytes.
        ``is_dense`` is not read: points with a non-finite coordinate, and points exactly (0, 0, 0), never count.
    intensity : str, optional
        The field that is the intensity, of any integer or float type, in the units stored. The result calls it
        "intensity", and no other field so. None, or a message without that field, gives points without an intensity.

    Returns
    -------
    ndarray
        Records of ``point_step`` bytes over the memory of the message, nothing copied: shape (width,), or (height,
        width) where ``height`` is above 1. Fields x, y and z (m, float32 or float64), intensity if there is one, and
        the other fields by their own names; one with a ``count`` above 1 has that many numbers a point. Read-only if
        ``data`` is. The points of a big-endian message are a copy in little-endian order.

    Raises
    ------
    TypeError
        If the message lacks a field, or an argument or a field is of another type.
    ValueError
        If it is not certain where the points lie: ``point_step`` is 0, the data are too short, or ``row_step`` is too
        small and the data are not exactly height x width x point_step bytes. If x, y and z are not certain: one is
        missing, is declared twice, or ends beyond ``point_step``, two share bytes, or they are not all float32 or all
        float64.
    NoDataError
        If the message has no points: a blind sensor, not free space.

    Notes
    -----
    Padding is honoured after points (``point_step``) and after rows (``row_step``); the last row may lack its padding
    [sensor_msgs/PointCloud2].

    Whatever else is odd is tolerated, and ``ttc_fast.pointcloud2.read_pointcloud2`` says what it was. A ``row_step``
    that cannot be right is replaced by width x point_step where the data are exactly as long as that makes them, or
    where there is one row. A ``count`` of 0 is read as 1. Fields without a name, declared twice, of an unknown
    datatype, or that end beyond ``point_step`` are ignored. So is an intensity that is one of these, has several
    numbers a point, or shares bytes with a coordinate; a gate that bounds the intensity refuses points without one.

    Examples
    --------
    >>> import types, numpy as np, ttc_fast
    >>> names = ["x", "y", "z"]
    >>> fields = [types.SimpleNamespace(name=n, offset=4 * i, datatype=7, count=1) for i, n in enumerate(names)]
    >>> data = np.array([[9.0, 0.0, 0.5, 0.0], [8.0, 0.1, 0.5, 0.0]], np.float32).tobytes()
    >>> msg = types.SimpleNamespace(
    ...     height=1, width=2, fields=fields, is_bigendian=False, point_step=16, row_step=32, data=data, is_dense=True
    ... )
    >>> points = ttc_fast.from_pointcloud2(msg)
    >>> points["x"]
    array([9., 8.], dtype=float32)
    >>> ttc_fast.robust_min_x(points, estimator=ttc_fast.Minimum()).x
    8.0
    """
    points, _ = read_pointcloud2(msg, intensity=intensity)
    if points.size == 0:
        raise NoDataError(
            f"msg.height x msg.width is {msg.height} x {msg.width}: a cloud without points is no data, and not free "
            "space"
        )
    return points


def read_pointcloud2(msg: Any, *, intensity: str | None = "intensity") -> tuple[NDArray[np.void], dict[str, str]]:
    """View the points of a PointCloud2 message, and say what is odd about the message.

    Parameters
    ----------
    msg, intensity
        As in ``from_pointcloud2``.

    Returns
    -------
    points : ndarray
        As from ``from_pointcloud2``; an empty one, of shape (0,), if the message has no points.
    oddities : dict of str to str
        What is odd about a message that can be read all the same: a sentence for each part of it, by the name of the
        part, which is "row_step", "data", "count", "fields" or "intensity". Nearly always empty.

    Raises
    ------
    TypeError, ValueError
        As from ``from_pointcloud2``.

    Examples
    --------
    >>> import types, numpy as np
    >>> from ttc_fast.pointcloud2 import read_pointcloud2
    >>> fields = [types.SimpleNamespace(name=n, offset=4 * i, datatype=7, count=1) for i, n in enumerate("xyz")]
    >>> data = np.ones((2, 3), np.float32).tobytes()
    >>> msg = types.SimpleNamespace(
    ...     height=1, width=2, fields=fields, is_bigendian=False, point_step=12, row_step=0, data=data, is_dense=True
    ... )
    >>> points, oddities = read_pointcloud2(msg)
    >>> points.shape, oddities
    ((2,), {'row_step': 'msg.row_step is 0; rows are read as width x point_step, 24 bytes'})
    """
    if not (intensity is None or isinstance(intensity, str)) or intensity in COORDINATES:
        raise TypeError(f"intensity must be the name of a field other than x, y and z, or None, got {intensity!r}")
    order = ">" if _get(msg, "is_bigendian") else "<"
    height, width, point_step, row_step = (_count(msg, name) for name in ("height", "width", "point_step", "row_step"))
    if height * width == 0:
        return NO_POINTS, {}
    if point_step == 0:
        raise ValueError("msg.point_step must be the bytes of a point, got 0")
    data = _bytes(_get(msg, "data"))
    row_step, oddities = _row_step(height, width, point_step, row_step, data.nbytes)
    layout = _layout(_fields(_get(msg, "fields")), point_step, intensity, order)
    # An array over the bytes first: it holds on to the buffer, so that the message cannot be resized under the view.
    held = np.frombuffer(data, np.uint8)
    if height == 1:
        points = np.ndarray(width, layout.records, held)
    else:
        points = np.ndarray((height, width), layout.records, held, 0, (row_step, point_step))
    if layout.little_endian is not None:
        points = points[list(layout.little_endian.names or ())].astype(layout.little_endian)
    return points, oddities | layout.oddities


def _row_step(height: int, width: int, point_step: int, row_step: int, length: int) -> tuple[int, dict[str, str]]:
    """Return the bytes from row to row, as the message says or as the length of its data leaves open; and oddities."""
    oddities = {}
    row = width * point_step
    needed = (height - 1) * max(row_step, row) + row
    is_unpadded = length == height * row
    if length < needed and not is_unpadded:
        raise ValueError(
            f"msg.data must have at least {needed} bytes for height {height}, row_step {row_step}, width {width} and "
            f"point_step {point_step}, got {length}: {needed - length} are missing; was the message cut off?"
        )
    if row_step < row and height > 1 and not is_unpadded:
        raise ValueError(
            f"msg.row_step must be at least width x point_step, {width} x {point_step} = {row} bytes, got {row_step}; "
            f"rows without padding need {height * row} bytes of data, and there are {length}"
        )
    if row_step < row or length < needed:
        oddities["row_step"] = f"msg.row_step is {row_step}; rows are read as width x point_step, {row} bytes"
        row_step = row
    if length - height * row >= height * point_step:
        room = length // point_step
        oddities["data"] = f"msg.data have room for {room} points; the {height} x {width} of height x width are read"
    return row_step, oddities


def _fields(fields: Any) -> tuple[_Field, ...]:
    """Return the fields of the message, unchecked."""
    try:
        listed = list(fields)
    except TypeError:
        raise TypeError(f"msg.fields must be a list of sensor_msgs/PointField, got {type(fields).__name__}") from None
    return tuple([_field(each) for each in listed])


def _field(field: Any) -> _Field:
    name = _get(field, "name", "msg.fields")
    if not isinstance(name, str):
        raise TypeError(f"msg.fields must have names, got {name!r}")
    where = f"msg.fields {name!r}"
    return _Field(name, *[_count(field, part, where) for part in ("offset", "datatype", "count")])


@lru_cache(maxsize=16)
def _layout(listed: tuple[_Field, ...], point_step: int, intensity: str | None, order: str) -> _Layout:
    """Choose the fields that can be used. Kept for the next message, which nearly always has the same."""
    if point_step > MOST_BYTES:
        raise ValueError(f"msg.point_step must be at most {MOST_BYTES} bytes, got {point_step}")
    oddities: dict[str, str] = {}
    fields = _usable(listed, point_step, intensity, oddities)
    xyz = _coordinates(fields)
    chosen = None if intensity is None else fields.pop(intensity, None)
    fields.pop("intensity", None)  # a field of that name which is not the chosen one
    if chosen is not None and chosen.numbers != 1:
        oddities["intensity"] = _ignored(chosen.name, f"has {chosen.numbers} numbers a point")
    elif chosen is not None and any(chosen.overlaps(each) for each in xyz):
        oddities["intensity"] = _ignored(chosen.name, "shares bytes with x, y or z")
    elif chosen is not None:
        fields["intensity"] = chosen
    little_endian = None
    if order == ">":
        kept = list(fields)
        if sum(field.size for field in fields.values()) > point_step:  # what shares bytes must not multiply the memory
            kept = [name for name in (*COORDINATES, "intensity") if name in fields]
        little_endian = _dtype({name: fields[name] for name in kept}, "<")
    return _Layout(_dtype(fields, order, point_step), little_endian, oddities)


def _usable(
    listed: tuple[_Field, ...], point_step: int, intensity: str | None, oddities: dict[str, str]
) -> dict[str, _Field]:
    """Leave out fields that cannot be used, and note why; refuse coordinates that cannot be used."""
    fields: dict[str, _Field] = {}
    ignored: set[str] = set()
    for field in listed:
        name = field.name
        if field.numbers == 0:
            oddities.setdefault("count", f"msg.fields {name!r} has count 0; it is read as 1")
            field = field._replace(numbers=1)
        problem = _problem(field, point_step)
        if not problem and fields.get(name, field) != field:
            problem = "is declared twice, in two places; give each field a name of its own"
        if problem and name in COORDINATES:
            raise ValueError(f"msg.fields {name!r} {problem}")
        if problem:
            oddities.setdefault("intensity" if name == intensity else "fields", _ignored(name, problem))
            ignored.add(name)
        fields[name] = field
    return {name: field for name, field in fields.items() if name not in ignored}


def _problem(field: _Field, point_step: int) -> str:
    """Say why a field cannot be used; nothing if it can be."""
    if not field.name:
        return "has no name"
    if field.datatype not in DATATYPES:
        return f"has the unknown datatype {field.datatype}; known are {_known(tuple(DATATYPES))}"
    if field.end > point_step:
        end = field.end
        return f"ends at byte {end}, beyond point_step {point_step}; its offset, its count or point_step is wrong"
    return ""


def _ignored(name: str, problem: str) -> str:
    return f"msg.fields {name!r} {problem}; it is ignored"


def _coordinates(fields: dict[str, _Field]) -> list[_Field]:
    """Check x, y and z, and return them in the order in which they lie in a point."""
    for name in COORDINATES:
        if name not in fields:
            raise ValueError(f"msg.fields must have x, y and z, got {list(fields)}; name the coordinates so")
        _, _, datatype, numbers = fields[name]
        if datatype not in FLOATS or numbers != 1:
            raise ValueError(
                f"msg.fields {name!r} must be one number of datatype {_known(FLOATS)}, "
                f"got datatype {DATATYPES[datatype][0]} and count {numbers}"
            )
        if datatype != fields["x"].datatype:
            raise ValueError(f"msg.fields must have x, y and z of one datatype, but x and {name} differ")
    xyz = sorted((fields[name] for name in COORDINATES), key=lambda field: field.offset)
    for one, other in pairwise(xyz):
        if one.overlaps(other):
            raise ValueError(f"msg.fields {one.name!r} and {other.name!r} share bytes; one of their offsets is wrong")
    return xyz


def _dtype(fields: dict[str, _Field], order: str, point_step: int | None = None) -> np.dtype[np.void]:
    """Make the dtype of one point, its fields where they lie or, without a ``point_step``, one after the other."""
    formats = [(order + DATATYPES[field.datatype][1], field.numbers) for field in fields.values()]
    described: Any = {"names": list(fields), "formats": [kind if n == 1 else (kind, n) for kind, n in formats]}
    if point_step is not None:
        described |= {"offsets": [field.offset for field in fields.values()], "itemsize": point_step}
    dtype: np.dtype[np.void] = np.dtype(described)
    return dtype


def _known(datatypes: tuple[int, ...]) -> str:
    return ", ".join(f"{DATATYPES[datatype][0]} ({datatype})" for datatype in datatypes)


def _get(message: Any, name: str, where: str = "msg") -> Any:
    try:
        return getattr(message, name)
    except AttributeError:
        kind = "sensor_msgs/PointCloud2" if where == "msg" else "list of sensor_msgs/PointField"
        raise TypeError(f"{where} must be a {kind}; it has no field {name}") from None


def _count(message: Any, name: str, where: str = "msg") -> int:
    """Return an unsigned integer of the message."""
    value = _get(message, name, where)
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{where}.{name} must be an integer, got {value!r}") from None
    if number < 0:
        raise ValueError(f"{where}.{name} must be at least 0, got {number}")
    return number


def _bytes(data: Any) -> memoryview:
    try:
        view = memoryview(data)
    except (BufferError, TypeError, ValueError):
        kind = type(data).__name__
        raise TypeError(f"msg.data must be bytes or a buffer of them, got {kind}; bytes(msg.data) makes one") from None
    if view.itemsize != 1:
        raise TypeError(f"msg.data must be a buffer of single bytes, got items of {view.itemsize} bytes")
    if not view.c_contiguous:
        raise ValueError("msg.data must be contiguous; bytes(msg.data) makes it so")
    return view
