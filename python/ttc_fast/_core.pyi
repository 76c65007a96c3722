from array import array
from collections.abc import Iterable, Sequence, Sized
from typing import Any, ClassVar, Generic, Literal, Protocol, TypeAlias, TypedDict, TypeVar, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Self, Unpack

from ttc_fast.status import Detection, RoadStatus, Status

__all__ = [
    "BUILD_PROFILE",
    "SIMD_LEVEL",
    "Alignment",
    "AlphaBeta",
    "CloudTTC",
    "CloudTracker",
    "Cluster",
    "Consensus",
    "Counts",
    "CountsBatch",
    "DistanceTracker",
    "EstimatedNoise",
    "Gate",
    "InterquartileFence",
    "KalmanCA",
    "KalmanCV",
    "KeypointTTC",
    "KthSmallest",
    "LeastSquares",
    "MeanOfLowest",
    "MedianRatio",
    "MinX",
    "Minimum",
    "MotionMixture",
    "Nearest",
    "NearestBatch",
    "NearestPoint",
    "NearestPointBatch",
    "NeighbourSupport",
    "NoDataError",
    "Quantile",
    "RangeRate",
    "RangeRateNearest",
    "Road",
    "RoadFit",
    "ScaleTracker",
    "ScanSweptPath",
    "ScanTTC",
    "SlidingLine",
    "SlidingParabola",
    "Supported",
    "SweptPath",
    "TheilSen",
    "TrackedTTC",
    "TrimmedMeanRatio",
    "__version__",
    "deceleration_to_avoid_crash",
    "fit_road",
    "ittc",
    "robust_min_x",
    "rss_longitudinal_distance",
    "stopping_distance",
    "time_headway",
    "ttc_constant_acceleration",
    "ttc_constant_velocity",
    "ttc_from_clouds",
    "ttc_from_distances",
    "ttc_from_heights",
    "ttc_from_keypoints",
    "ttc_from_scale",
]

_Number: TypeAlias = float | np.floating[Any] | np.integer[Any]
_Float: TypeAlias = np.float32 | np.float64
_FloatT = TypeVar("_FloatT", bound=np.float32 | np.float64)
_Row = TypeVar("_Row", covariant=True)
# Tensors are taken too. But arrays of NumPy look like one to a type checker, whatever their dtype and dimensions.
_Buffer: TypeAlias = array[float] | memoryview[Any] | Sequence[float] | Sequence[Sequence[float]]
# An array whose type does not tell its dimensions counts as one scan, unless a motion is an array as well.
_Scan: TypeAlias = np.ndarray[tuple[int], np.dtype[_Float]] | _Buffer
_Scans: TypeAlias = np.ndarray[tuple[int, int], np.dtype[_Float]]

BUILD_PROFILE: str  # Cargo's: release in wheels
SIMD_LEVEL: str
__version__: str

# What classes share; at run time each has these methods itself.
class _Settings:
    def __getnewargs_ex__(self) -> tuple[tuple[()], dict[str, Any]]: ...

class _Value(_Settings):
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

class _Remembers(_Settings):
    def reset(self) -> None: ...
    def state(self) -> dict[str, Any]: ...
    def restore(self, state: dict[str, Any]) -> None: ...
    def __getstate__(self) -> dict[str, Any]: ...
    def __setstate__(self, state: dict[str, Any], /) -> None: ...

class _Shown:
    @classmethod
    def _make(cls, values: Iterable[Any]) -> Self: ...
    def _asdict(self) -> dict[str, Any]: ...
    def _repr_html_(self) -> str: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

class _Result(_Shown):
    def __hash__(self) -> int: ...

class _Batch(_Shown, Generic[_Row]):
    __hash__: ClassVar[None]  # type: ignore[assignment]
    def __len__(self) -> int: ...
    def __getitem__(self, key: int, /) -> _Row: ...

class NoDataError(ValueError): ...

@overload
def ittc(  # type: ignore[overload-overlap]
    ranges: _Number,
    *,
    closing_speed: _Number,
    range_rate: None = None,
    min_closing_speed: _Number = 0.0,
    out: None = None,
    status_out: None = None,
) -> float: ...
@overload
def ittc(  # type: ignore[overload-overlap]
    ranges: _Number,
    *,
    closing_speed: None = None,
    range_rate: _Number,
    min_closing_speed: _Number = 0.0,
    out: None = None,
    status_out: None = None,
) -> float: ...
@overload
def ittc(
    ranges: _Number | NDArray[_FloatT],
    *,
    closing_speed: _Number | NDArray[_FloatT],
    range_rate: None = None,
    min_closing_speed: _Number = 0.0,
    out: NDArray[_FloatT] | None = None,
    status_out: NDArray[np.uint8] | None = None,
) -> NDArray[_FloatT]: ...
@overload
def ittc(
    ranges: _Number | NDArray[_FloatT],
    *,
    closing_speed: None = None,
    range_rate: _Number | NDArray[_FloatT],
    min_closing_speed: _Number = 0.0,
    out: NDArray[_FloatT] | None = None,
    status_out: NDArray[np.uint8] | None = None,
) -> NDArray[_FloatT]: ...
@overload
def ittc(
    ranges: _Number | NDArray[_Float] | _Buffer,
    *,
    closing_speed: _Number | NDArray[_Float] | _Buffer,
    range_rate: None = None,
    min_closing_speed: _Number = 0.0,
    out: NDArray[_Float] | None = None,
    status_out: NDArray[np.uint8] | None = None,
) -> NDArray[Any]: ...
@overload
def ittc(
    ranges: _Number | NDArray[_Float] | _Buffer,
    *,
    closing_speed: None = None,
    range_rate: _Number | NDArray[_Float] | _Buffer,
    min_closing_speed: _Number = 0.0,
    out: NDArray[_Float] | None = None,
    status_out: NDArray[np.uint8] | None = None,
) -> NDArray[Any]: ...

@final
class KthSmallest(_Value):
    def __new__(cls, k: int) -> Self: ...
    @property
    def k(self) -> int: ...

@final
class NeighbourSupport(_Value):
    def __new__(cls, count: int = 1, window: int = 2, gap: float = 0.2) -> Self: ...
    @property
    def count(self) -> int: ...
    @property
    def window(self) -> int: ...
    @property
    def gap(self) -> float: ...

@final
class Counts(_Result):
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
class CountsBatch(_Batch[Counts]):
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

@final
class Nearest(_Result):
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
class NearestBatch(_Batch[Nearest]):
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

class _ScanSettings(TypedDict, total=False):
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
    threads: int

@final
class ScanTTC(_Value):
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
        threads: int = 1,
    ) -> Self: ...
    @classmethod
    def from_message(cls, msg: _LaserScan, **settings: Unpack[_ScanSettings]) -> Self: ...
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
    def angle_min(self) -> float: ...
    @property
    def angle_increment(self) -> float: ...
    @property
    def beams(self) -> int: ...
    @property
    def range_min(self) -> float: ...
    @property
    def range_max(self) -> float: ...
    @property
    def limits(self) -> tuple[float, float] | None: ...
    @property
    def limits_policy(self) -> Literal["horizon", "clamp"]: ...
    @property
    def mount(self) -> tuple[float, float, float]: ...
    @property
    def outline(self) -> tuple[float, float, float, float] | None: ...
    @property
    def mask(self) -> tuple[bool, ...] | None: ...
    @property
    def min_closing_speed(self) -> float: ...
    @property
    def too_close(self) -> Literal["hit", "ignore"]: ...
    @property
    def no_data(self) -> float | None: ...
    @property
    def minimum(self) -> KthSmallest | NeighbourSupport | None: ...
    @property
    def threads(self) -> int: ...
    @property
    def angles(self) -> NDArray[np.float64]: ...

@final
class RangeRateNearest(_Result):
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
    def standard_error(self) -> float: ...
    @property
    def counts(self) -> Counts: ...
    @property
    def rated(self) -> int: ...
    @property
    def unrated(self) -> int: ...
    @property
    def nearest_unrated(self) -> float: ...
    @property
    def age(self) -> float: ...

@final
class RangeRate(_Remembers):
    def __new__(
        cls,
        scan: ScanTTC,
        *,
        window: _Number = 0.5,
        min_scans: int = 4,
        noise: _Number = 0.01,
        max_speed: _Number = 20.0,
        max_acceleration: _Number = 5.0,
        gate: _Number = 3.0,
        significance: _Number = 3.0,
        edge: _Number = 0.2,
        minimum: KthSmallest | NeighbourSupport | None = None,
    ) -> Self: ...
    @overload
    def update(
        self,
        ranges: NDArray[_FloatT],
        stamp: _Number,
        yaw_rate: _Number = 0.0,
        *,
        range_rate_out: NDArray[_FloatT] | None = None,
        standard_error_out: NDArray[_FloatT] | None = None,
        status_out: NDArray[np.uint8] | None = None,
    ) -> RangeRateNearest: ...
    @overload
    def update(
        self,
        ranges: _Buffer,
        stamp: _Number,
        yaw_rate: _Number = 0.0,
        *,
        range_rate_out: NDArray[_Float] | None = None,
        standard_error_out: NDArray[_Float] | None = None,
        status_out: NDArray[np.uint8] | None = None,
    ) -> RangeRateNearest: ...
    @property
    def scan(self) -> ScanTTC: ...
    @property
    def window(self) -> float: ...
    @property
    def min_scans(self) -> int: ...
    @property
    def noise(self) -> float: ...
    @property
    def max_speed(self) -> float: ...
    @property
    def max_acceleration(self) -> float: ...
    @property
    def gate(self) -> float: ...
    @property
    def significance(self) -> float: ...
    @property
    def edge(self) -> float: ...
    @property
    def minimum(self) -> KthSmallest | NeighbourSupport: ...

@final
class ScanSweptPath(_Value):
    def __new__(cls, scan: ScanTTC, *, horizon: _Number = 5.0) -> Self: ...
    @overload
    def min(
        self,
        ranges: _Scan,
        speed: _Number,
        yaw_rate: _Number = 0.0,
        lateral_speed: _Number = 0.0,
        *,
        path: ArrayLike | None = None,
    ) -> float: ...
    @overload
    def min(
        self,
        ranges: _Scans,
        speed: ArrayLike,
        yaw_rate: ArrayLike = 0.0,
        lateral_speed: ArrayLike = 0.0,
        *,
        path: ArrayLike | None = None,
    ) -> NDArray[np.float64]: ...
    @overload
    def nearest(
        self,
        ranges: _Scan,
        speed: _Number,
        yaw_rate: _Number = 0.0,
        lateral_speed: _Number = 0.0,
        *,
        path: ArrayLike | None = None,
    ) -> Nearest: ...
    @overload
    def nearest(
        self,
        ranges: _Scans,
        speed: ArrayLike,
        yaw_rate: ArrayLike = 0.0,
        lateral_speed: ArrayLike = 0.0,
        *,
        path: ArrayLike | None = None,
    ) -> NearestBatch: ...
    @overload
    def per_beam(
        self,
        ranges: NDArray[_FloatT],
        speed: ArrayLike,
        yaw_rate: ArrayLike = 0.0,
        lateral_speed: ArrayLike = 0.0,
        *,
        path: ArrayLike | None = None,
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
        path: ArrayLike | None = None,
        out: NDArray[_Float] | None = None,
        status_out: NDArray[np.uint8] | None = None,
    ) -> NDArray[Any]: ...
    def unseen(
        self,
        speed: _Number,
        yaw_rate: _Number = 0.0,
        lateral_speed: _Number = 0.0,
        *,
        ahead: _Number,
        others: Sequence[ScanSweptPath] = (),
    ) -> float: ...
    @property
    def scan(self) -> ScanTTC: ...
    @property
    def horizon(self) -> float: ...

_Intensity: TypeAlias = np.uint8 | np.uint16 | np.float32 | np.float64
_Column: TypeAlias = NDArray[_Float]
# Rows, records, or one array each for x, y, z and perhaps intensity.
_Points: TypeAlias = (
    NDArray[_Float]
    | NDArray[np.void]
    | tuple[_Column, _Column, _Column]
    | tuple[_Column, _Column, _Column, NDArray[_Intensity]]
)
_Interval: TypeAlias = tuple[float, float]
_Bounds: TypeAlias = tuple[_Number, _Number]

@final
class Minimum(_Value):
    def __new__(cls) -> Self: ...

@final
class Quantile(_Value):
    def __new__(cls, q: _Number) -> Self: ...
    @property
    def q(self) -> float: ...

@final
class MeanOfLowest(_Value):
    def __new__(cls, k: int) -> Self: ...
    @property
    def k(self) -> int: ...

@final
class InterquartileFence(_Value):
    def __new__(cls, factor: _Number) -> Self: ...
    @property
    def factor(self) -> float: ...

@final
class Supported(_Value):
    def __new__(cls, points: int, gap: _Number) -> Self: ...
    @property
    def points(self) -> int: ...
    @property
    def gap(self) -> float: ...

@final
class Cluster(_Value):
    def __new__(cls, tolerance: _Number, min_points: int) -> Self: ...
    @property
    def tolerance(self) -> float: ...
    @property
    def min_points(self) -> int: ...

_Estimator: TypeAlias = Minimum | KthSmallest | Quantile | MeanOfLowest | InterquartileFence | Supported | Cluster

@final
class Road(_Value):
    def __new__(cls, slope_x: _Number, slope_y: _Number, offset: _Number) -> Self: ...
    @property
    def slope_x(self) -> float: ...
    @property
    def slope_y(self) -> float: ...
    @property
    def offset(self) -> float: ...
    def height(self, x: _Number, y: _Number, z: _Number) -> float: ...

class _GateSettings(TypedDict, total=False):
    x: _Bounds
    y: _Bounds
    intensity: _Bounds | None
    axes: tuple[str, str, str] | None
    curvature: _Number
    road: Road | None
    height: _Bounds | None

@final
class Gate(_Value):
    def __new__(
        cls,
        x: _Bounds = ...,
        y: _Bounds = (-2.0, 2.0),
        z: _Bounds | None = None,
        intensity: _Bounds | None = None,
        axes: tuple[str, str, str] | None = ("x", "y", "z"),
        *,
        curvature: _Number = 0.0,
        road: Road | None = None,
        height: _Bounds | None = None,
    ) -> Self: ...
    @staticmethod
    def above_road(
        sensor_height: _Number,
        clearance: _Number = 0.2,
        headroom: _Number = 2.0,
        *,
        front: _Number | None = None,
        **settings: Unpack[_GateSettings],
    ) -> Gate: ...
    @property
    def x(self) -> _Interval: ...
    @property
    def y(self) -> _Interval: ...
    @property
    def z(self) -> _Interval | None: ...
    @property
    def intensity(self) -> _Interval | None: ...
    @property
    def axes(self) -> tuple[str, str, str]: ...
    @property
    def curvature(self) -> float: ...
    @property
    def road(self) -> Road | None: ...
    @property
    def height(self) -> _Interval | None: ...

@final
class NearestPoint(_Result):
    @property
    def ttc(self) -> float: ...
    @property
    def status(self) -> Status: ...
    @property
    def index(self) -> int: ...
    @property
    def x(self) -> float: ...
    @property
    def y(self) -> float: ...
    @property
    def clearance(self) -> float: ...
    @property
    def closing_speed(self) -> float: ...
    @property
    def counts(self) -> Counts: ...

@final
class NearestPointBatch(_Batch[NearestPoint]):
    @property
    def ttc(self) -> NDArray[np.float64]: ...
    @property
    def status(self) -> NDArray[np.uint8]: ...
    @property
    def index(self) -> NDArray[np.int64]: ...
    @property
    def x(self) -> NDArray[np.float64]: ...
    @property
    def y(self) -> NDArray[np.float64]: ...
    @property
    def clearance(self) -> NDArray[np.float64]: ...
    @property
    def closing_speed(self) -> NDArray[np.float64]: ...
    @property
    def counts(self) -> CountsBatch: ...

# One cloud: rows, records, or columns. An array whose type does not tell its dimensions counts as one.
_Plane: TypeAlias = (
    np.ndarray[tuple[int, int], np.dtype[_Float]]
    | np.ndarray[tuple[int], np.dtype[np.void]]
    | tuple[_Column, _Column]
    | tuple[_Column, _Column, _Column]
    | tuple[_Column, _Column, _Column, NDArray[_Intensity]]
)
# A batch of them.
_Planes: TypeAlias = np.ndarray[tuple[int, int, int], np.dtype[_Float]] | np.ndarray[tuple[int, int], np.dtype[np.void]]

@final
class SweptPath(_Value):
    def __new__(
        cls,
        outline: tuple[_Number, _Number, _Number, _Number],
        *,
        horizon: _Number = 5.0,
        no_data: _Number | None = None,
    ) -> Self: ...
    @overload
    def min(
        self,
        points: _Plane,
        speed: _Number,
        yaw_rate: _Number = 0.0,
        lateral_speed: _Number = 0.0,
        *,
        path: ArrayLike | None = None,
    ) -> float: ...
    @overload
    def min(
        self,
        points: _Planes,
        speed: ArrayLike,
        yaw_rate: ArrayLike = 0.0,
        lateral_speed: ArrayLike = 0.0,
        *,
        path: ArrayLike | None = None,
    ) -> NDArray[np.float64]: ...
    @overload
    def nearest(
        self,
        points: _Plane,
        speed: _Number,
        yaw_rate: _Number = 0.0,
        lateral_speed: _Number = 0.0,
        *,
        path: ArrayLike | None = None,
    ) -> NearestPoint: ...
    @overload
    def nearest(
        self,
        points: _Planes,
        speed: ArrayLike,
        yaw_rate: ArrayLike = 0.0,
        lateral_speed: ArrayLike = 0.0,
        *,
        path: ArrayLike | None = None,
    ) -> NearestPointBatch: ...
    @overload
    def per_point(
        self,
        points: NDArray[_FloatT],
        speed: ArrayLike,
        yaw_rate: ArrayLike = 0.0,
        lateral_speed: ArrayLike = 0.0,
        *,
        path: ArrayLike | None = None,
        out: NDArray[_FloatT] | None = None,
        status_out: NDArray[np.uint8] | None = None,
    ) -> NDArray[_FloatT]: ...
    @overload
    def per_point(
        self,
        points: _Points | tuple[_Column, _Column],
        speed: ArrayLike,
        yaw_rate: ArrayLike = 0.0,
        lateral_speed: ArrayLike = 0.0,
        *,
        path: ArrayLike | None = None,
        out: NDArray[_Float] | None = None,
        status_out: NDArray[np.uint8] | None = None,
    ) -> NDArray[Any]: ...
    @property
    def outline(self) -> tuple[float, float, float, float]: ...
    @property
    def horizon(self) -> float: ...
    @property
    def no_data(self) -> float | None: ...

@final
class MinX(_Result):
    @property
    def x(self) -> float: ...
    @property
    def nearest_x(self) -> float: ...
    @property
    def candidates(self) -> int: ...
    @property
    def support(self) -> int: ...
    @property
    def index(self) -> int: ...
    @property
    def detection(self) -> Detection: ...

@final
class CloudTTC(_Result):
    @property
    def ttc(self) -> float: ...
    @property
    def status(self) -> Status: ...
    @property
    def distance(self) -> float: ...
    @property
    def closing_speed(self) -> float: ...
    @property
    def previous(self) -> MinX: ...
    @property
    def current(self) -> MinX: ...

@final
class RoadFit(_Result):
    @property
    def road(self) -> Road | None: ...
    @property
    def status(self) -> RoadStatus: ...
    @property
    def reason(self) -> str: ...
    @property
    def inliers(self) -> int: ...
    @property
    def patches(self) -> int: ...
    @property
    def share(self) -> float: ...
    @property
    def width(self) -> float: ...
    @property
    def rms(self) -> float: ...

def fit_road(
    points: _Points,
    *,
    sensor_height: _Number = 1.73,
    x: _Bounds = (0.0, 30.0),
    y: _Bounds = (-6.0, 6.0),
    axes: tuple[str, str, str] | None = ("x", "y", "z"),
    height_tolerance: _Number = 0.5,
    max_slope: _Number = 0.2,
    tolerance: _Number = 0.1,
    min_patches: int = 25,
    min_width: _Number = 2.0,
    min_share: _Number = 0.25,
) -> RoadFit: ...
def robust_min_x(
    points: _Points, *, gate: Gate | None = None, estimator: _Estimator | None = None, threads: int = 1
) -> MinX: ...
def ttc_from_distances(previous: _Number, current: _Number, dt: _Number) -> float: ...
def ttc_from_clouds(
    previous: _Points,
    current: _Points,
    dt: _Number,
    *,
    gate: Gate | None = None,
    estimator: _Estimator | None = None,
    front_offset: _Number = 0.0,
) -> CloudTTC: ...

@final
class Alignment(_Value):
    def __new__(
        cls,
        cell: tuple[_Number, _Number] = (0.2, 0.05),
        *,
        depth: _Number = 0.8,
        window: _Number = 1.0,
        range_noise: _Number = 0.02,
    ) -> Self: ...
    @property
    def cell(self) -> tuple[float, float]: ...
    @property
    def depth(self) -> float: ...
    @property
    def window(self) -> float: ...
    @property
    def range_noise(self) -> float: ...

@final
class TrackedTTC(_Result):
    @property
    def ttc(self) -> float: ...
    @property
    def ttc_interval(self) -> tuple[float, float] | None: ...
    @property
    def distance(self) -> float: ...
    @property
    def closing_speed(self) -> float: ...
    @property
    def closing_speed_interval(self) -> tuple[float, float] | None: ...
    @property
    def status(self) -> Status: ...
    @property
    def age(self) -> float: ...

@final
class CloudTracker(_Remembers):
    def __new__(
        cls,
        gate: Gate | None = None,
        *,
        estimator: _Estimator | None = None,
        method: Alignment | None = None,
        front_offset: _Number = 0.0,
        jump: _Number = 0.5,
        max_gap: _Number = 0.5,
        min_closing_speed: _Number = 0.05,
    ) -> Self: ...
    def update(self, points: _Points, stamp: _Number) -> TrackedTTC: ...
    @property
    def gate(self) -> Gate: ...
    @property
    def estimator(self) -> _Estimator: ...
    @property
    def method(self) -> Alignment: ...
    @property
    def front_offset(self) -> float: ...
    @property
    def jump(self) -> float: ...
    @property
    def max_gap(self) -> float: ...
    @property
    def own_vehicle(self) -> float | None: ...
    @property
    def min_closing_speed(self) -> float: ...

@final
class SlidingLine(_Value):
    def __new__(cls, window: _Number = 0.5, acceleration: _Number = 1.0) -> Self: ...
    @property
    def window(self) -> float: ...
    @property
    def acceleration(self) -> float: ...

@final
class SlidingParabola(_Value):
    def __new__(cls, window: _Number = 1.0, jerk: _Number = 1.0) -> Self: ...
    @property
    def window(self) -> float: ...
    @property
    def jerk(self) -> float: ...

@final
class TheilSen(_Value):
    def __new__(cls, window: _Number = 0.5, acceleration: _Number = 1.0) -> Self: ...
    @property
    def window(self) -> float: ...
    @property
    def acceleration(self) -> float: ...

@final
class AlphaBeta(_Value):
    def __new__(cls, memory: _Number = 0.2, acceleration: _Number = 1.0) -> Self: ...
    @property
    def memory(self) -> float: ...
    @property
    def acceleration(self) -> float: ...

@final
class MotionMixture(_Value):
    def __new__(cls, memory: _Number = 2.0, scale: _Number = 1.0) -> Self: ...
    @property
    def memory(self) -> float: ...
    @property
    def scale(self) -> float: ...

@final
class KalmanCV(_Value):
    def __new__(cls, acceleration: _Number = 0.7) -> Self: ...
    @property
    def acceleration(self) -> float: ...

@final
class KalmanCA(_Value):
    def __new__(cls, jerk: _Number = 1.5, acceleration: _Number = 3.0) -> Self: ...
    @property
    def jerk(self) -> float: ...
    @property
    def acceleration(self) -> float: ...

@final
class EstimatedNoise(_Value):
    def __new__(cls, start: _Number = 0.03, frames: _Number = 30.0) -> Self: ...
    @property
    def start(self) -> float: ...
    @property
    def frames(self) -> float: ...

_Method: TypeAlias = MotionMixture | SlidingLine | SlidingParabola | TheilSen | AlphaBeta | KalmanCV | KalmanCA

@final
class DistanceTracker(_Remembers):
    def __new__(
        cls,
        method: _Method | None = None,
        *,
        noise: _Number | EstimatedNoise | None = None,
        gate: _Number = 4.0,
        jump: _Number = 1.0,
        confirm: int = 3,
        max_gap: _Number = 1.0,
        max_speed: _Number = 100.0,
        min_closing_speed: _Number = 0.05,
    ) -> Self: ...
    def update(self, distance: _Number | None, stamp: _Number, noise: _Number | None = None) -> TrackedTTC: ...
    @property
    def method(self) -> _Method: ...
    @property
    def noise(self) -> float | EstimatedNoise: ...
    @property
    def gate(self) -> float: ...
    @property
    def jump(self) -> float: ...
    @property
    def confirm(self) -> int: ...
    @property
    def max_gap(self) -> float: ...
    @property
    def max_speed(self) -> float: ...
    @property
    def min_closing_speed(self) -> float: ...

@final
class ScaleTracker(_Remembers):
    def __new__(
        cls, distance: _Number = 10.0, *, max_gap: _Number = 1.0, min_closing_speed: _Number = 0.05
    ) -> Self: ...
    def update(
        self,
        scale: _Number | None,
        stamp: _Number,
        spread: _Number | None = None,
        *,
        distance: _Number | None = None,
        distance_noise: _Number | None = None,
        displacement: _Number | None = None,
        displacement_noise: _Number | None = None,
    ) -> TrackedTTC: ...
    @property
    def distance(self) -> float: ...
    @property
    def max_gap(self) -> float: ...
    @property
    def min_closing_speed(self) -> float: ...

_Operand: TypeAlias = _Number | NDArray[np.float32] | NDArray[np.float64]

@overload
def ttc_constant_velocity(distance: _Number, *, closing_speed: _Number, status_out: None = None) -> float: ...
@overload
def ttc_constant_velocity(
    distance: NDArray[_FloatT],
    *,
    closing_speed: _Number | NDArray[_FloatT],
    status_out: NDArray[np.uint8] | None = None,
) -> NDArray[_FloatT]: ...
@overload
def ttc_constant_velocity(
    distance: _Operand, *, closing_speed: _Operand, status_out: NDArray[np.uint8] | None = None
) -> Any: ...
@overload
def ttc_constant_acceleration(
    distance: _Number, *, closing_speed: _Number, closing_acceleration: _Number, status_out: None = None
) -> float: ...
@overload
def ttc_constant_acceleration(
    distance: NDArray[_FloatT],
    *,
    closing_speed: _Number | NDArray[_FloatT],
    closing_acceleration: _Number | NDArray[_FloatT],
    status_out: NDArray[np.uint8] | None = None,
) -> NDArray[_FloatT]: ...
@overload
def ttc_constant_acceleration(
    distance: _Operand,
    *,
    closing_speed: _Operand,
    closing_acceleration: _Operand,
    status_out: NDArray[np.uint8] | None = None,
) -> Any: ...
@overload
def time_headway(distance: _Number, *, speed: _Number) -> float: ...
@overload
def time_headway(distance: NDArray[_FloatT], *, speed: _Number | NDArray[_FloatT]) -> NDArray[_FloatT]: ...
@overload
def time_headway(distance: _Operand, *, speed: _Operand) -> Any: ...
@overload
def deceleration_to_avoid_crash(distance: _Number, *, closing_speed: _Number) -> float: ...
@overload
def deceleration_to_avoid_crash(
    distance: NDArray[_FloatT], *, closing_speed: _Number | NDArray[_FloatT]
) -> NDArray[_FloatT]: ...
@overload
def deceleration_to_avoid_crash(distance: _Operand, *, closing_speed: _Operand) -> Any: ...
@overload
def stopping_distance(speed: _Number, *, deceleration: _Number, reaction_time: _Number) -> float: ...
@overload
def stopping_distance(
    speed: NDArray[_FloatT], *, deceleration: _Number | NDArray[_FloatT], reaction_time: _Number | NDArray[_FloatT]
) -> NDArray[_FloatT]: ...
@overload
def stopping_distance(speed: _Operand, *, deceleration: _Operand, reaction_time: _Operand) -> Any: ...
@overload
def rss_longitudinal_distance(
    rear_speed: _Number,
    front_speed: _Number,
    *,
    response_time: _Number,
    acceleration_max: _Number,
    braking_min: _Number,
    braking_max: _Number,
) -> float: ...
@overload
def rss_longitudinal_distance(
    rear_speed: NDArray[_FloatT],
    front_speed: _Number | NDArray[_FloatT],
    *,
    response_time: _Number | NDArray[_FloatT],
    acceleration_max: _Number | NDArray[_FloatT],
    braking_min: _Number | NDArray[_FloatT],
    braking_max: _Number | NDArray[_FloatT],
) -> NDArray[_FloatT]: ...
@overload
def rss_longitudinal_distance(
    rear_speed: _Operand,
    front_speed: _Operand,
    *,
    response_time: _Operand,
    acceleration_max: _Operand,
    braking_min: _Operand,
    braking_max: _Operand,
) -> Any: ...

@final
class MedianRatio(_Value):
    def __new__(cls) -> Self: ...

@final
class TrimmedMeanRatio(_Value):
    def __new__(cls, share: _Number = 0.25) -> Self: ...
    @property
    def share(self) -> float: ...

@final
class LeastSquares(_Value):
    def __new__(cls) -> Self: ...

@final
class Consensus(_Value):
    def __new__(cls, tolerance: _Number = 5.0, trials: int = 200, seed: int = 0) -> Self: ...
    @property
    def tolerance(self) -> float: ...
    @property
    def trials(self) -> int: ...
    @property
    def seed(self) -> int: ...

_ScaleEstimator: TypeAlias = Consensus | MedianRatio | TrimmedMeanRatio | LeastSquares

@final
class KeypointTTC(_Result):
    @property
    def ttc(self) -> float: ...
    @property
    def status(self) -> Status: ...
    @property
    def scale(self) -> float: ...
    @property
    def spread(self) -> float: ...
    @property
    def ttc_interval(self) -> tuple[float, float] | None: ...
    @property
    def pairs(self) -> int: ...
    @property
    def matches(self) -> int: ...
    @property
    def support(self) -> int: ...

def ttc_from_scale(scale: _Number, dt: _Number) -> float: ...
def ttc_from_heights(previous: _Number, current: _Number, dt: _Number) -> float: ...
def ttc_from_keypoints(
    previous: NDArray[_Float] | _Buffer,
    current: NDArray[_Float] | _Buffer,
    dt: _Number,
    *,
    min_distance: _Number = 100.0,
    estimator: _ScaleEstimator | None = None,
    threads: int = 1,
) -> KeypointTTC: ...
