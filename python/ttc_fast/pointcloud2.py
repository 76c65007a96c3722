"""sensor_msgs/PointCloud2 as a record array over the bytes of the message, without ROS and without a copy."""

from __future__ import annotations

import operator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast._core import NoDataError

if TYPE_CHECKING:
    from numpy.typing import NDArray

DATATYPES = {
    1: ("INT8", "<i1"),
    2: ("UINT8", "<u1"),
    3: ("INT16", "<i2"),
    4: ("UINT16", "<u2"),
    5: ("INT32", "<i4"),
    6: ("UINT32", "<u4"),
    7: ("FLOAT32", "<f4"),
    8: ("FLOAT64", "<f8"),
}
"""Name in sensor_msgs/PointField and dtype, by datatype."""
COORDINATES = (7, 8)
INTENSITIES = (2, 4, 7, 8)


@dataclass(frozen=True)
class _Field:
    """A checked PointField."""

    offset: int
    datatype: int
    count: int

    @property
    def dtype(self) -> np.dtype[Any]:
        _, dtype = DATATYPES[self.datatype]
        return np.dtype(dtype) if self.count == 1 else np.dtype((dtype, self.count))


def from_pointcloud2(msg: Any, *, intensity: str | None = "intensity") -> NDArray[np.void]:
    """View the points of a PointCloud2 message as a record array, which ``robust_min_x`` reads in place.

    Parameters
    ----------
    msg : sensor_msgs/PointCloud2, of ROS 1, ROS 2 or anything with the same fields
        The message. Its ``height``, ``width``, ``fields``, ``is_bigendian``, ``point_step``, ``row_step`` and ``data``
        are read; ``data`` may be bytes, an array.array, an ndarray of bytes or any other contiguous buffer of bytes.
        ``is_dense`` is not read: points with a non-finite coordinate, and points exactly (0, 0, 0), never count.
    intensity : str, optional
        The field that is the intensity, in the units stored. The result calls it "intensity", and no other field so.
        None, or a message without that field, gives points without an intensity.

    Returns
    -------
    ndarray
        Records of ``point_step`` bytes over the memory of the message, nothing copied: shape (width,), or (height,
        width) where ``height`` is above 1. Fields x, y and z (m, float32 or float64), intensity if there is one, and
        the other fields by their own names; one with a ``count`` above 1 has that many numbers a point. Read-only if
        ``data`` is.

    Raises
    ------
    TypeError
        If the message lacks a field, or an argument or a field is of another type.
    ValueError
        If the message is big-endian, its fields do not fit its steps, its data are too short, or its x, y and z are
        missing or are not all float32 or all float64.
    NoDataError
        If the message has no points: a blind sensor, not free space.

    Notes
    -----
    Padding is honoured after points (``point_step``) and after rows (``row_step``); the last row may lack its padding
    [sensor_msgs/PointCloud2].

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
    if not (intensity is None or isinstance(intensity, str)) or intensity in ("x", "y", "z"):
        raise TypeError(f"intensity must be the name of a field other than x, y and z, or None, got {intensity!r}")
    if _get(msg, "is_bigendian"):
        raise ValueError(
            "msg.is_bigendian is true: swap the bytes of each number and set it to false; where all fields have 4 "
            "bytes, numpy.frombuffer(msg.data, numpy.uint32).byteswap().tobytes() does it"
        )
    height, width, point_step, row_step = (_count(msg, name) for name in ("height", "width", "point_step", "row_step"))
    if height * width == 0:
        raise NoDataError(
            f"msg.height x msg.width is {height} x {width}: a cloud without points is no data, and not free space"
        )
    if point_step == 0:
        raise ValueError("msg.point_step must be the bytes of a point, got 0")
    if row_step < width * point_step:
        raise ValueError(
            f"msg.row_step must be at least width x point_step, {width} x {point_step} = {width * point_step} bytes, "
            f"got {row_step}; without padding it is that"
        )
    data = _bytes(_get(msg, "data"))
    needed = (height - 1) * row_step + width * point_step
    if data.nbytes < needed:
        raise ValueError(
            f"msg.data must have at least {needed} bytes for height {height}, row_step {row_step}, width {width} and "
            f"point_step {point_step}, got {data.nbytes}: {needed - data.nbytes} are missing; was the message cut off?"
        )
    records = _records(_get(msg, "fields"), point_step, intensity)
    # An array over the bytes first: it holds on to the buffer, so that the message cannot be resized under the view.
    held = np.frombuffer(data, np.uint8)
    if height == 1:
        return np.ndarray(width, records, held)
    return np.ndarray((height, width), records, held, 0, (row_step, point_step))


def _records(fields: Any, point_step: int, intensity: str | None) -> np.dtype[np.void]:
    """Make the dtype of one point."""
    found = _checked(fields, point_step)
    for name in ("x", "y", "z"):
        if name not in found:
            raise ValueError(f"msg.fields must have x, y and z, got {list(found)}; name the coordinates so")
        _check_type(name, found[name], COORDINATES)
        if found[name].datatype != found["x"].datatype:
            raise ValueError(f"msg.fields must have x, y and z of one datatype, but x and {name} differ")
    chosen = None if intensity is None else found.pop(intensity, None)
    found.pop("intensity", None)  # a field of that name which is not the chosen one
    if chosen is not None:
        _check_type(str(intensity), chosen, INTENSITIES, fix="; intensity=None leaves it out")
        found["intensity"] = chosen
    return np.dtype(
        {
            "names": list(found),
            "formats": [field.dtype for field in found.values()],
            "offsets": [field.offset for field in found.values()],
            "itemsize": point_step,
        }
    )


def _checked(fields: Any, point_step: int) -> dict[str, _Field]:
    """Check every field of the message, and return them by name."""
    found: dict[str, _Field] = {}
    try:
        listed = list(fields)
    except TypeError:
        raise TypeError(f"msg.fields must be a list of sensor_msgs/PointField, got {type(fields).__name__}") from None
    for listed_field in listed:
        name = _get(listed_field, "name", "msg.fields")
        if not isinstance(name, str) or not name:
            raise TypeError(f"msg.fields must have names, got {name!r}")
        if name in found:
            raise ValueError(f"msg.fields has {name!r} twice; give each field a name of its own")
        found[name] = _field(listed_field, f"msg.fields {name!r}", point_step)
    return found


def _field(field: Any, where: str, point_step: int) -> _Field:
    offset, datatype, count = (_count(field, name, where) for name in ("offset", "datatype", "count"))
    if datatype not in DATATYPES:
        raise ValueError(f"{where} has the unknown datatype {datatype}; known are {_known(tuple(DATATYPES))}")
    if count == 0:
        raise ValueError(f"{where} has count 0; a single number has count 1")
    end = offset + count * np.dtype(DATATYPES[datatype][1]).itemsize
    if end > point_step:
        raise ValueError(
            f"{where} ends at byte {end}, beyond point_step {point_step}; its offset, its count or point_step is wrong"
        )
    return _Field(offset, datatype, count)


def _check_type(name: str, field: _Field, accepted: tuple[int, ...], fix: str = "") -> None:
    if field.datatype not in accepted or field.count != 1:
        got, _ = DATATYPES[field.datatype]
        raise ValueError(
            f"msg.fields {name!r} must be one number of datatype {_known(accepted)}, "
            f"got datatype {got} and count {field.count}{fix}"
        )


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
    except TypeError:
        kind = type(data).__name__
        raise TypeError(f"msg.data must be bytes or a buffer of them, got {kind}; bytes(msg.data) makes one") from None
    if view.itemsize != 1:
        raise TypeError(f"msg.data must be a buffer of single bytes, got items of {view.itemsize} bytes")
    if not view.c_contiguous:
        raise ValueError("msg.data must be contiguous; bytes(msg.data) makes it so")
    return view
