"""A recording for Foxglove, as MCAP: what the brake decides, at the times at which the log recorded its frames.

.. code-block:: text

    /ttc/decision    ttc_fast.Row               a row of the replay, a field for each column
    /ttc/vehicle     foxglove.SceneUpdate       outline, path, gate, and what decides
    /ttc/points      foxglove.PointCloud        threats and strays; everything seen, where the log is no bag
    /ttc/log         foxglove.Log               each change of the decision
    /ttc/tf          foxglove.FrameTransform    where the sensor is, once, where the bag does not say it

The messages are Foxglove's own schemas, and not those of ROS, because they are the same beside a bag of ROS 1, one of
ROS 2 and a log that knows neither. A row has no schema there, so its own follows from its columns. A bag and its
recording open together: times of messages are those of the bag, and all is drawn in the frame of the vehicle.

https://docs.foxglove.dev/docs/sdk/schemas
"""

from __future__ import annotations

import math
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast import __version__
from ttc_fast._extras import missing
from ttc_fast.brake import Command
from ttc_fast.logs.log import REP_103, origin
from ttc_fast.logs.ros import BagScans
from ttc_fast.replay.drawing import ALARM, CAUTION, INK, LINE, QUIET, URGENCY, shown
from ttc_fast.replay.pipelines import placement_of
from ttc_fast.replay.row import TYPES, UNITS, plain
from ttc_fast.sensors.clouds import Placement

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from ttc_fast.replay.drawing import Colour, Drawing, Lines
    from ttc_fast.replay.row import Row
    from ttc_fast.replay.run import Replay

BASE_FRAME = "base_link"
"""The frame of the vehicle where the log has none."""
NOT_PLACED = Placement(np.eye(3), np.zeros(3))
"""Where a sensor is that nothing places: in the frame of the vehicle."""
SECOND = 1_000_000_000
POINT = np.dtype([*((name, "<f4") for name in "xyz"), *((name, "u1") for name in ("red", "green", "blue", "alpha"))])
LEVELS = {Command.NONE: "INFO", Command.WARN: "WARNING", Command.BRAKE: "ERROR"}


def recorded(replay: Replay, rows: Iterable[Row], path: Path) -> Iterator[Row]:
    """Pass rows on, and write each with its drawing into a recording, as ``scrub.recorded`` does."""
    try:
        from mcap_protobuf.writer import Writer

        messages = Messages(getattr(replay.log, "base_frame", BASE_FRAME))
    except ModuleNotFoundError:
        raise missing("a recording for Foxglove", "mcap_protobuf") from None
    begin, first = getattr(replay.log, "begin", 0), True
    with path.open("wb") as file, Writer(file) as writer:
        about = {"log": origin(replay.log.path), "clock": replay.log.clock, "version": __version__}
        criteria = ", ".join(map(str, replay.pipeline.controller.criteria))
        units = {f"unit of {name}": unit for name, unit in UNITS.items()}
        writer.add_metadata("ttc_fast", {**about, "criteria": criteria, **units})
        for row, drawing, said in shown(replay, rows):
            if first:
                begin = max(begin, -round(row.stamp * SECOND))  # no time of a recording is negative
            stamp = max(begin + round(row.stamp * SECOND), 0)
            recorded_at = getattr(replay.frame, "recorded", None)
            time = stamp if recorded_at is None else recorded_at
            of_frame = {"/ttc/decision": messages.decision(row)}
            if first and (transform := messages.transform(replay, stamp)) is not None:
                of_frame["/ttc/tf"] = transform
            if drawing is not None:
                of_frame["/ttc/vehicle"] = messages.drawing(drawing, row.command, stamp)
                of_frame["/ttc/points"] = messages.points(drawing, stamp, everything=recorded_at is None)
            if said:
                of_frame["/ttc/log"] = messages.log(said, row.command, stamp)
            for topic, message in of_frame.items():
                writer.write_message(topic, message, log_time=time, publish_time=time)
            first = False
            yield row


class Messages:
    """Makes the messages of a recording.

    Parameters
    ----------
    frame : str
        The frame of the vehicle.
    """

    def __init__(self, frame: str) -> None:
        self._frame, self._row = frame, row_type()

    def __getattr__(self, name: str) -> Any:
        """Return the type of a message of Foxglove: ``messages.Log``."""
        return getattr(import_module(f"foxglove_schemas_protobuf.{name}_pb2"), name)

    def decision(self, row: Row) -> Any:
        """Return a row. A number that is infinite or not known is NaN, and one that was not counted is left out."""
        values = zip(TYPES, plain(row), strict=True)
        numbers = {name: _drawable(value) for name, value in values if value is not None}
        return self._row(**numbers)

    def drawing(self, drawing: Drawing, command: Command, stamp: int) -> Any:
        """Return the lines of a drawing and what decides, which replace those of the frame before."""
        colour = URGENCY[command]
        entity = self.SceneEntity(timestamp=_time(stamp), frame_id=self._frame, id="ttc", frame_locked=True)
        entity.lines.extend(self._lines([*drawing.outline, *drawing.path], colour))
        entity.lines.extend(self._lines(drawing.gate, LINE))
        if drawing.at is not None:
            at = dict(zip("xyz", drawing.at, strict=True))
            place = self.Pose(position=at, orientation={"w": 1.0})
            entity.spheres.add(pose=place, size={"x": 0.2, "y": 0.2, "z": 0.2}, color=_colour(INK))
            entity.texts.add(
                pose=place, billboard=True, font_size=14, scale_invariant=True, color=_colour(INK), text=drawing.decides
            )
        return self.SceneUpdate(entities=[entity])

    def _lines(self, lines: Lines, colour: Colour) -> Iterator[Any]:
        upright = {"orientation": {"w": 1.0}}
        for line in lines:
            points = [{"x": x, "y": y, "z": z} for x, y, z in line.tolist()]
            yield self.LinePrimitive(
                pose=upright, thickness=2.0, scale_invariant=True, points=points, color=_colour(colour)
            )

    def points(self, drawing: Drawing, stamp: int, *, everything: bool) -> Any:
        """Return the points of a drawing, each with its colour: all of them, or those that threaten and strays."""
        kept = drawing.threatening | drawing.strays | everything
        packed = np.zeros(int(kept.sum()), POINT)
        packed["x"], packed["y"], packed["z"] = drawing.points[kept].T
        colours = np.full((len(drawing.points), 3), QUIET)
        colours[drawing.strays], colours[drawing.threatening] = CAUTION, ALARM
        packed["red"], packed["green"], packed["blue"] = colours[kept].T
        packed["alpha"] = 255
        kinds = {"<f4": "FLOAT32", "|u1": "UINT8"}
        kind = self.PackedElementField.NumericType
        fields = [
            self.PackedElementField(name=name, offset=offset, type=kind.Value(kinds[each.str]))
            for name, (each, offset, *_) in (POINT.fields or {}).items()
        ]
        return self.PointCloud(
            timestamp=_time(stamp),
            frame_id=self._frame,
            pose={"orientation": {"w": 1.0}},
            point_stride=POINT.itemsize,
            fields=fields,
            data=packed.tobytes(),
        )

    def log(self, said: str, command: Command, stamp: int) -> Any:
        """Return a decision in words."""
        level = self.Log.Level.Value(LEVELS[command])
        return self.Log(timestamp=_time(stamp), level=level, message=said, name="ttc_fast")

    def transform(self, replay: Replay, stamp: int) -> Any:
        """Return where the replay takes the sensor to be, where the bag does not say it; else None."""
        frame = getattr(replay.log, "unplaced_frame", "")
        if not frame:
            return None
        turn, shift = _placement(replay)
        return self.FrameTransform(
            timestamp=_time(stamp),
            parent_frame_id=self._frame,
            child_frame_id=frame,
            translation=dict(zip("xyz", shift.tolist(), strict=True)),
            rotation=dict(zip("xyzw", quaternion_of(turn), strict=True)),
        )


def row_type() -> Any:
    """Return the type of the message of a row, whose fields are the columns."""
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    field = descriptor_pb2.FieldDescriptorProto
    kinds = {float: field.TYPE_DOUBLE, int: field.TYPE_INT64, int | None: field.TYPE_INT64}
    file = descriptor_pb2.FileDescriptorProto(name="ttc_fast/row.proto", package="ttc_fast", syntax="proto2")
    message = file.message_type.add(name="Row")
    for number, (name, kind) in enumerate(TYPES.items(), start=1):
        kind = kinds.get(kind, field.TYPE_STRING)
        message.field.add(name=name, number=number, label=field.LABEL_OPTIONAL, type=kind)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName("ttc_fast.Row"))


def _drawable(value: Any) -> Any:
    """Return NaN, which is a gap in a curve, for a number that is infinite."""
    return math.nan if isinstance(value, float) and math.isinf(value) else value


def _time(stamp: int) -> dict[str, int]:
    seconds, nanos = divmod(stamp, SECOND)
    return {"seconds": seconds, "nanos": nanos}


def _colour(colour: Colour) -> dict[str, float]:
    red, green, blue = (each / 255.0 for each in colour)
    return {"r": red, "g": green, "b": blue, "a": 1.0}


def _placement(replay: Replay) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the rotation and the shift from the sensor to the vehicle."""
    if not isinstance(replay.log, BagScans):
        return replay.pipeline.placement or NOT_PLACED
    turn, shift = placement_of(None, replay.pipeline.mount, REP_103, by_user=True) or NOT_PLACED
    return turn @ np.diag([1.0, -1.0, -1.0]) if replay.log.upside_down else turn, shift


def quaternion_of(turn: NDArray[np.float64]) -> list[float]:
    """Return a rotation as a quaternion x, y, z, w: the axis that its matrix keeps, by the eigenvector of Bar-Itzhack.

    [I. Y. Bar-Itzhack: New Method for Extracting the Quaternion from a Rotation Matrix, Journal of Guidance, Control
    and Dynamics 23 (2000), pages 1085 to 1087]

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast.replay.foxglove import quaternion_of
    >>> [round(abs(each), 3) for each in quaternion_of(np.diag([1.0, -1.0, -1.0]))]  # half a turn about x
    [1.0, 0.0, 0.0, 0.0]
    """
    outer = np.zeros((4, 4))
    outer[:3, :3] = turn + turn.T - np.trace(turn) * np.eye(3)
    outer[:3, 3] = outer[3, :3] = turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]
    outer[3, 3] = np.trace(turn)
    quaternion: list[float] = np.linalg.eigh(outer)[1][:, -1].tolist()
    return quaternion
