from array import array
from collections.abc import Sequence, Sized
from typing import Any, ClassVar, Literal, Protocol, TypeAlias, TypedDict, TypeVar, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Self, Unpack

from ttc_fast.status import Status

__all__ = [
    "SIMD_LEVEL",
    "Counts",
    "CountsBatch",
    "KthSmallest",
    "Nearest",
    "NearestBatch",
    "NeighbourSupport",
    "NoDataError",
    "ScanTTC",
    "ittc",
]

_Number: TypeAlias = float | np.floating[Any] | np.integer[Any]
_Float: TypeAlias = np.float32 | np.float64
_FloatT = TypeVar("_FloatT", bound=np.float32 | np.float64)
_Buffer: TypeAlias = array[float] | memoryview[Any]
# An array whose type does not tell its dimensions counts as one scan, unless a motion is an array as well.
_Scan: TypeAlias = np.ndarray[tuple[int], np.dtype[_Float]] | _Buffer
_Scans: TypeAlias = np.ndarray[tuple[int, int], np.dtype[_Float]]

SIMD_LEVEL: str

class NoDataError(ValueError): ...

@overload
def ittc(
    ranges: NDArray[_FloatT],
    *,
    closing_speed: _Number | NDArray[_FloatT],
    range_rate: None = None,
    min_closing_speed: _Number = 0.0,
    out: NDArray[_FloatT] | None = None,
    status_out: NDArray[np.uint8] | None = None,
) -> NDArray[_FloatT]: ...
@overload
def ittc(
    ranges: NDArray[_FloatT],
    *,
    closing_speed: None = None,
    range_rate: _Number | NDArray[_FloatT],
    min_closing_speed: _Number = 0.0,
    out: NDArray[_FloatT] | None = None,
    status_out: NDArray[np.uint8] | None = None,
) -> NDArray[_FloatT]: ...
@overload
def ittc(
    ranges: _Buffer,
    *,
    closing_speed: _Number | NDArray[_Float] | _Buffer,
    range_rate: None = None,
    min_closing_speed: _Number = 0.0,
    out: NDArray[_Float] | None = None,
    status_out: NDArray[np.uint8] | None = None,
) -> NDArray[Any]: ...
@overload
def ittc(
    ranges: _Buffer,
    *,
    closing_speed: None = None,
    range_rate: _Number | NDArray[_Float] | _Buffer,
    min_closing_speed: _Number = 0.0,
    out: NDArray[_Float] | None = None,
    status_out: NDArray[np.uint8] | None = None,
) -> NDArray[Any]: ...

@final
class KthSmallest:
    def __new__(cls, k: int) -> Self: ...
    @property
    def k(self) -> int: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __getnewargs__(self) -> tuple[int]: ...

@final
class NeighbourSupport:
    def __new__(cls, count: int = 1, window: int = 2, gap: float = 0.2) -> Self: ...
    @property
    def count(self) -> int: ...
    @property
    def window(self) -> int: ...
    @property
    def gap(self) -> float: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    def __getnewargs__(self) -> tuple[int, int, float]: ...

@final
class Counts:
    @property
    def valid(self) -> int: ...
    @property
    def invalid(self) -> int: ...
    @property
    def too_close(self) -> int: ...
    @property
    def no_return(self) -> int: ...
    @property
    def out_of_range(self) -> int: ...
    @property
    def beyond_limits(self) -> int: ...
    @property
    def masked(self) -> int: ...
    @property
    def contact(self) -> int: ...

@final
class CountsBatch:
    @property
    def valid(self) -> NDArray[np.uint32]: ...
    @property
    def invalid(self) -> NDArray[np.uint32]: ...
    @property
    def too_close(self) -> NDArray[np.uint32]: ...
    @property
    def no_return(self) -> NDArray[np.uint32]: ...
    @property
    def out_of_range(self) -> NDArray[np.uint32]: ...
    @property
    def beyond_limits(self) -> NDArray[np.uint32]: ...
    @property
    def masked(self) -> NDArray[np.uint32]: ...
    @property
    def contact(self) -> NDArray[np.uint32]: ...
    def __len__(self) -> int: ...

@final
class Nearest:
    @property
    def ttc(self) -> float: ...
    @property
    def status(self) -> Status: ...
    @property
    def beam(self) -> int: ...
    @property
    def angle(self) -> float: ...
    @property
    def range(self) -> float: ...
    @property
    def clearance(self) -> float: ...
    @property
    def closing_speed(self) -> float: ...
    @property
    def counts(self) -> Counts: ...

@final
class NearestBatch:
    @property
    def ttc(self) -> NDArray[np.float64]: ...
    @property
    def status(self) -> NDArray[np.uint8]: ...
    @property
    def beam(self) -> NDArray[np.int64]: ...
    @property
    def angle(self) -> NDArray[np.float64]: ...
    @property
    def range(self) -> NDArray[np.float64]: ...
    @property
    def clearance(self) -> NDArray[np.float64]: ...
    @property
    def closing_speed(self) -> NDArray[np.float64]: ...
    @property
    def counts(self) -> CountsBatch: ...
    def __len__(self) -> int: ...
    def __getitem__(self, key: int, /) -> Nearest: ...

# What `from_message` reads of a sensor_msgs/LaserScan.
class _LaserScan(Protocol):
    @property
    def angle_min(self) -> float: ...
    @property
    def angle_increment(self) -> float: ...
    @property
    def range_min(self) -> float: ...
    @property
    def range_max(self) -> float: ...
    @property
    def ranges(self) -> Sized: ...

class _Settings(TypedDict, total=False):
    angle_min: _Number
    angle_increment: _Number
    beams: int
    range_min: _Number
    range_max: _Number
    limits: tuple[_Number, _Number] | None
    limits_policy: Literal["horizon", "clamp"]
    mount: tuple[_Number, _Number, _Number]
    outline: tuple[_Number, _Number, _Number, _Number] | None
    mask: Sequence[bool] | NDArray[np.bool_] | None
    min_closing_speed: _Number
    too_close: Literal["hit", "ignore"]
    no_data: _Number | None
    minimum: KthSmallest | NeighbourSupport | None

@final
class ScanTTC:
    def __new__(
        cls,
        angle_min: _Number,
        angle_increment: _Number,
        beams: int,
        *,
        range_min: _Number = 0.0,
        range_max: _Number = ...,
        limits: tuple[_Number, _Number] | None = None,
        limits_policy: Literal["horizon", "clamp"] = "horizon",
        mount: tuple[_Number, _Number, _Number] = (0.0, 0.0, 0.0),
        outline: tuple[_Number, _Number, _Number, _Number] | None = None,
        mask: Sequence[bool] | NDArray[np.bool_] | None = None,
        min_closing_speed: _Number = 0.01,
        too_close: Literal["hit", "ignore"] = "hit",
        no_data: _Number | None = None,
        minimum: KthSmallest | NeighbourSupport | None = None,
    ) -> Self: ...
    @classmethod
    def from_message(cls, msg: _LaserScan, **settings: Unpack[_Settings]) -> Self: ...
    @overload
    def min(self, ranges: _Scan, speed: _Number, yaw_rate: _Number = 0.0, lateral_speed: _Number = 0.0) -> float: ...
    @overload
    def min(
        self, ranges: _Scans, speed: ArrayLike, yaw_rate: ArrayLike = 0.0, lateral_speed: ArrayLike = 0.0
    ) -> NDArray[np.float64]: ...
    @overload
    def nearest(
        self, ranges: _Scan, speed: _Number, yaw_rate: _Number = 0.0, lateral_speed: _Number = 0.0
    ) -> Nearest: ...
    @overload
    def nearest(
        self, ranges: _Scans, speed: ArrayLike, yaw_rate: ArrayLike = 0.0, lateral_speed: ArrayLike = 0.0
    ) -> NearestBatch: ...
    @overload
    def per_beam(
        self,
        ranges: NDArray[_FloatT],
        speed: ArrayLike,
        yaw_rate: ArrayLike = 0.0,
        lateral_speed: ArrayLike = 0.0,
        *,
        out: NDArray[_FloatT] | None = None,
        status_out: NDArray[np.uint8] | None = None,
    ) -> NDArray[_FloatT]: ...
    @overload
    def per_beam(
        self,
        ranges: _Buffer,
        speed: ArrayLike,
        yaw_rate: ArrayLike = 0.0,
        lateral_speed: ArrayLike = 0.0,
        *,
        out: NDArray[_Float] | None = None,
        status_out: NDArray[np.uint8] | None = None,
    ) -> NDArray[Any]: ...
    @property
    def beams(self) -> int: ...
    @property
    def angles(self) -> NDArray[np.float64]: ...
    def __getnewargs_ex__(self) -> tuple[tuple[float, float, int], dict[str, object]]: ...
