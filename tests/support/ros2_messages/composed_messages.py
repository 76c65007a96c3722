"""Messages of ROS 2 that no package registry has, composed of messages that one has.

rclpy needs a type support for each message: C functions that make and serialise it. Here they are functions of Python,
which serialise each part of a message by the type support of that part. Between rclpy and the middleware a message is
an address that stands for an object of Python. Everything else is real: the bytes, the name and the hash of the type.
"""

from __future__ import annotations

import ctypes
from ctypes import CFUNCTYPE, POINTER, c_bool, c_char, c_char_p, c_size_t, c_uint8, c_uint32, c_void_p
from typing import Any

from std_msgs.msg import Header, UInt32

IDENTIFIER, OF_FIELDS = b"rosidl_typesupport_fastrtps_c", b"rosidl_typesupport_introspection_c"
MAKE, DESTROY = CFUNCTYPE(c_void_p), CFUNCTYPE(None, c_void_p)
FROM_PYTHON = ctypes.PYFUNCTYPE(c_bool, ctypes.py_object, c_void_p)
TO_PYTHON = ctypes.PYFUNCTYPE(ctypes.py_object, c_void_p)
WRITE, READ = CFUNCTYPE(c_bool, c_void_p, c_void_p), CFUNCTYPE(c_bool, c_void_p, c_void_p)
SIZE, MOST = CFUNCTYPE(c_uint32, c_void_p), CFUNCTYPE(c_size_t, POINTER(c_char))
OF_SUPPORT, CHOOSE = CFUNCTYPE(c_void_p, c_void_p), CFUNCTYPE(c_void_p, c_void_p, c_char_p)

capsule = ctypes.pythonapi.PyCapsule_New
capsule.restype, capsule.argtypes = ctypes.py_object, [c_void_p, c_char_p, c_void_p]
address = ctypes.pythonapi.PyCapsule_GetPointer
address.restype, address.argtypes = c_void_p, [ctypes.py_object, c_char_p]


class Callbacks(ctypes.Structure):
    """message_type_support_callbacks_t [rosidl_typesupport_fastrtps_cpp, Jazzy]."""

    _fields_ = (
        ("namespace", c_char_p),
        ("name", c_char_p),
        ("write", WRITE),
        ("read", READ),
        ("size", SIZE),
        ("most", MOST),
        ("key", c_void_p),
    )


class Fields(ctypes.Structure):
    """rosidl_typesupport_introspection_c__MessageMembers [Jazzy]; no field is described."""

    _fields_ = (
        ("namespace", c_char_p),
        ("name", c_char_p),
        ("count", c_uint32),
        ("size", c_size_t),
        ("has_key", c_bool),
        ("fields", c_void_p),
        ("init", c_void_p),
        ("fini", c_void_p),
    )


class Support(ctypes.Structure):
    """rosidl_message_type_support_t [rosidl_runtime_c, Jazzy]."""

    _fields_ = (
        ("identifier", c_char_p),
        ("data", c_void_p),
        ("choose", CHOOSE),
        ("hash", OF_SUPPORT),
        ("description", c_void_p),
        ("sources", c_void_p),
    )


class Hash(ctypes.Structure):
    """rosidl_type_hash_t."""

    _fields_ = (("version", c_uint8), ("value", c_uint8 * 32))


class Part:
    """The type support of a message that is installed."""

    def __init__(self, kind: Any) -> None:
        kind.__class__.__import_type_support__()
        package, name = kind.__module__.split(".")[0], kind.__name__
        library = ctypes.CDLL(f"lib{package}__{IDENTIFIER.decode()}.so")
        own, meta = f"{package}__msg__{name}", kind.__class__
        self._make = MAKE(address(meta._CREATE_ROS_MESSAGE, None))
        self._destroy = DESTROY(address(meta._DESTROY_ROS_MESSAGE, None))
        self._from_python = FROM_PYTHON(address(meta._CONVERT_FROM_PY, None))
        self._to_python = TO_PYTHON(address(meta._CONVERT_TO_PY, None))
        self._write = WRITE((f"cdr_serialize_{own}", library))
        self._read = READ((f"cdr_deserialize_{own}", library))
        self._size = CFUNCTYPE(c_size_t, c_void_p, c_size_t)((f"get_serialized_size_{own}", library))

    def write(self, message: Any, cdr: int) -> bool:
        at = self._of(message)
        try:
            return bool(self._write(at, cdr))
        finally:
            self._destroy(at)

    def size(self, message: Any, start: int) -> int:
        """Return the bytes that a message takes which begins there; they depend on how it is aligned."""
        at = self._of(message)
        try:
            return int(self._size(at, start))
        finally:
            self._destroy(at)

    def _of(self, message: Any) -> int:
        at: int = self._make()
        assert self._from_python(message, at)
        return at

    def read(self, cdr: int) -> Any:
        at = self._make()
        try:
            assert self._read(cdr, at)
            return self._to_python(at)
        finally:
            self._destroy(at)


class Several:
    """A sequence of parts of one kind: their number, and each of them."""

    def __init__(self, kind: Any) -> None:
        self._count, self._part = Part(UInt32), Part(kind)

    def write(self, messages: Any, cdr: int) -> bool:
        return self._count.write(UInt32(data=len(messages)), cdr) and all(self._part.write(m, cdr) for m in messages)

    def size(self, messages: Any, start: int) -> int:
        end = start + self._count.size(UInt32(), start)
        for each in messages:
            end += self._part.size(each, end)
        return end - start

    def read(self, cdr: int) -> list[Any]:
        return [self._part.read(cdr) for _ in range(self._count.read(cdr).data)]


class Composed(type):
    """The metaclass of a composed message, where rclpy looks for the type support."""

    _CREATE_ROS_MESSAGE = _CONVERT_FROM_PY = _CONVERT_TO_PY = _DESTROY_ROS_MESSAGE = _TYPE_SUPPORT = None

    def __import_type_support__(cls) -> None:
        raise NotImplementedError("the function support gives it")


def support(kind: Any, package: str, type_hash: str, fields: Any) -> None:
    """Give a class its type support.

    Parameters
    ----------
    kind : type
        The class of the message; its metaclass is a subclass of ``Composed`` of its own.
    package : str
        The package of the message.
    type_hash : str
        The hash of the type, hexadecimal.
    fields : callable
        ``fields(None)`` returns (part, None) for each part of a message, and ``fields(message)`` its value as well;
        ``kind.of(values)`` makes a message of the values.
    """
    parts = [part for part, _ in fields(None)]
    alive: dict[int, list[Any]] = {}  # the message behind each address

    def make() -> int:
        holder = [kind()]
        alive[id(holder)] = holder
        return id(holder)

    def from_python(message: Any, at: int) -> bool:
        alive[at][0] = message
        return isinstance(message, kind)

    def write(at: int, cdr: int) -> bool:
        return all(part.write(value, cdr) for part, value in fields(alive[at][0]))

    def size(at: int) -> int:
        end = 0
        for part, value in fields(alive[at][0]):
            end += part.size(value, end)
        return end

    def read(cdr: int, at: int) -> bool:
        alive[at][0] = kind.of([part.read(cdr) for part in parts])
        return True

    def most(bounds: Any) -> int:
        bounds[0] = b"\0"  # unbounded
        return 0

    namespace, name = f"{package}::msg".encode(), kind.__name__.encode()
    digest = Hash(1, (c_uint8 * 32)(*bytes.fromhex(type_hash)))
    callbacks = Callbacks(namespace, name, WRITE(write), READ(read), SIZE(size), MOST(most))
    introspection = Fields(namespace.replace(b"::", b"__"), name)
    header = ctypes.CDLL("libstd_msgs__rosidl_generator_c.so")  # its description stands for that of the message
    rest: Any = (
        CHOOSE(lambda _, identifier: next((ctypes.addressof(s) for s in found if s.identifier == identifier), None)),
        OF_SUPPORT(lambda _: ctypes.addressof(digest)),
        ctypes.cast(header.std_msgs__msg__Header__get_type_description, c_void_p),
        ctypes.cast(header.std_msgs__msg__Header__get_type_description_sources, c_void_p),
    )
    found: list[Support] = [
        Support(identifier, ctypes.addressof(data), *rest)
        for identifier, data in ((IDENTIFIER, callbacks), (OF_FIELDS, introspection))
    ]
    functions = [MAKE(make), DESTROY(alive.__delitem__), FROM_PYTHON(from_python), TO_PYTHON(lambda at: alive[at][0])]
    meta = kind.__class__
    meta._keep = digest, callbacks, introspection, found, functions
    made, destroyed, from_py, to_py = (capsule(ctypes.cast(each, c_void_p), None, None) for each in functions)
    meta._CREATE_ROS_MESSAGE, meta._DESTROY_ROS_MESSAGE = made, destroyed
    meta._CONVERT_FROM_PY, meta._CONVERT_TO_PY = from_py, to_py
    meta._TYPE_SUPPORT = capsule(ctypes.addressof(found[0]), None, None)


__all__ = ["Composed", "Header", "Part", "Several", "support"]
