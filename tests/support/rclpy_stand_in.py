"""As much of ROS 2's Python client library as the adapter uses: rclpy itself is in no package registry.

Its messages are as strict as the real ones: a field takes only its type, and no other field can be set.
"""

from __future__ import annotations

import sys
from array import array
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

if TYPE_CHECKING:
    import pytest

ACKERMANN = {
    "ackermann_msgs/msg/AckermannDrive": "float32 steering_angle\nfloat32 steering_angle_velocity\nfloat32 speed\n"
    "float32 acceleration\nfloat32 jerk",
    "ackermann_msgs/msg/AckermannDriveStamped": "std_msgs/Header header\nackermann_msgs/AckermannDrive drive",
}
STORE = get_typestore(Stores.ROS2_HUMBLE)
for _name, _text in ACKERMANN.items():
    STORE.register(get_types_from_msg(_text, _name))
PACKAGES = (
    "ackermann_msgs",
    "builtin_interfaces",
    "diagnostic_msgs",
    "geometry_msgs",
    "nav_msgs",
    "rcl_interfaces",
    "sensor_msgs",
    "std_msgs",
    "tf2_msgs",
    "visualization_msgs",
)
BASE, NAME = 1, 2
ARRAYS = {"float32": "f", "float64": "d", "uint8": "B"}
PYTHON = {"string": str, "bool": bool, "float32": float, "float64": float, "byte": bytes}


class Message:
    """A message, of which each subclass knows its fields."""

    _kinds: dict[str, Any]

    def __init__(self, **values: Any) -> None:
        for name, kind in self._kinds.items():
            object.__setattr__(self, name, default(kind))
        for name, value in values.items():
            setattr(self, name, value)

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self._kinds:
            raise AttributeError(f"{type(self).__name__} has no field {name}")
        node, detail = self._kinds[name]
        if node == BASE:
            wanted = PYTHON.get(detail[0], int)
            assert isinstance(value, wanted), f"{name} must be a {wanted.__name__}, got {value!r}"
        elif node != NAME and detail[0][0] == BASE and detail[0][1][0] in ARRAYS:
            code = ARRAYS[detail[0][1][0]]
            value = array(code, value)
        object.__setattr__(self, name, value)


def default(kind: Any) -> Any:
    """Return what a field is that nobody set."""
    node, detail = kind
    if node == BASE:
        return b"\0" if detail[0] == "byte" else PYTHON.get(detail[0], int)()
    if node == NAME:
        return KINDS[detail]()
    element = detail[0]
    return array(ARRAYS[element[1][0]]) if element[0] == BASE and element[1][0] in ARRAYS else []


KINDS: dict[str, type[Message]] = {
    name: type(
        name.rpartition("/")[2],
        (Message,),
        {"_kinds": {field: (kind.value, _plain) for field, (kind, _plain) in fields}},
    )
    for name, (_, fields) in STORE.fielddefs.items()
}


class Graph:
    """What a ROS graph is to one node: its clock, what others publish, and what it publishes."""

    def __init__(self) -> None:
        self.now = 100.0
        self.types: dict[str, list[str]] = {}
        self.overrides: dict[str, Any] = {}
        self.published: dict[str, list[Any]] = {}
        self.subscriptions: dict[str, tuple[type[Message], Any]] = {}
        self.timers: list[tuple[float, Any]] = []
        self.descriptors: dict[str, Any] = {}

    def deliver(self, topic: str, message: Message) -> None:
        kind, call = self.subscriptions[topic]
        assert isinstance(message, kind)
        call(message)


class Publisher:
    def __init__(self, graph: Graph, kind: type[Message], topic: str) -> None:
        self.graph, self.kind, self.topic = graph, kind, topic

    def publish(self, message: Message) -> None:
        assert isinstance(message, self.kind)
        self.graph.published.setdefault(self.topic, []).append(message)

    def get_subscription_count(self) -> int:
        return 1


def node_of(graph: Graph) -> type:
    """Return the class Node of one graph."""

    class Node:
        def __init__(self, name: str) -> None:
            self.name = name
            self.parameters: dict[str, Any] = {}
            self.check: Any = None

        def declare_parameter(self, name: str, value: Any, descriptor: Any) -> None:
            assert name not in self.parameters
            assert value is not None
            assert not isinstance(value, tuple)
            graph.descriptors[name] = descriptor
            value = graph.overrides.get(name, value)
            self.parameters[name] = array("d", value) if _are_floats(value) else value

        def get_parameter(self, name: str) -> Any:
            return SimpleNamespace(name=name, value=self.parameters[name])

        def add_on_set_parameters_callback(self, check: Any) -> None:
            self.check = check

        def set_parameters(self, parameters: list[Any]) -> Any:
            answer = self.check(parameters)
            if answer.successful:
                self.parameters.update({each.name: each.value for each in parameters})
            return answer

        def create_publisher(self, kind: type[Message], topic: str, depth: int) -> Publisher:
            assert depth == 1
            return Publisher(graph, kind, topic)

        def create_subscription(self, kind: type[Message], topic: str, call: Any, qos: Any) -> None:
            latched = SimpleNamespace(depth=100, durability="transient local")
            assert qos == (latched if topic == "/tf_static" else "sensor data")
            graph.subscriptions[topic] = kind, call

        def create_timer(self, period: float, call: Any, clock: Any) -> None:
            assert clock.clock_type == "steady"
            graph.timers.append((period, call))

        def get_clock(self) -> Any:
            nanoseconds = round(graph.now * 1e9)
            sec, nanosec = divmod(nanoseconds, 10**9)
            stamp = KINDS["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
            now = SimpleNamespace(nanoseconds=nanoseconds, to_msg=lambda: stamp)
            return SimpleNamespace(now=lambda: now)

        def get_topic_names_and_types(self) -> list[tuple[str, list[str]]]:
            return list(graph.types.items())

        def resolve_topic_name(self, topic: str) -> str:
            return "/" + topic.lstrip("/")

    return Node


def _are_floats(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(each, float) for each in value)


def install(patch: pytest.MonkeyPatch) -> Graph:
    """Make it what `import rclpy` and the imports of its messages find."""
    graph = Graph()
    modules: dict[str, Any] = {
        "rclpy": {"init": lambda args=None: None, "spin": lambda node: None, "try_shutdown": lambda: None},
        "rclpy.node": {"Node": node_of(graph)},
        "rclpy.clock": {"Clock": SimpleNamespace, "ClockType": SimpleNamespace(STEADY_TIME="steady")},
        "rclpy.qos": {
            "qos_profile_sensor_data": "sensor data",
            "QoSProfile": SimpleNamespace,
            "DurabilityPolicy": SimpleNamespace(TRANSIENT_LOCAL="transient local"),
        },
    }
    for package in PACKAGES:
        modules[package] = {}
        prefix = f"{package}/msg/"
        modules[f"{package}.msg"] = {
            name.removeprefix(prefix): kind for name, kind in KINDS.items() if name.startswith(prefix)
        }
    for name, contents in modules.items():
        module = ModuleType(name)
        vars(module).update(contents)
        patch.setitem(sys.modules, name, module)
    return graph
