"""What a sceptic found: memory that moves under a view, numbers that change while they are read, forked threads."""

from __future__ import annotations

import array
import math
import multiprocessing
import threading
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import ttc_fast

BEAMS = 1 << 20


class Resizes:
    """A number that, when it is converted, takes the memory of an array away."""

    def __init__(self, victim: Any) -> None:
        self.victim = victim

    def __float__(self) -> float:
        self.victim.resize(1, refcheck=False)
        return 5.0


@pytest.mark.parametrize("method", ["min", "nearest", "per_beam"])
def test_arrays_are_looked_at_after_all_numbers_are_converted(method: str) -> None:
    scan = ttc_fast.ScanTTC(0.0, 1e-7, BEAMS)
    ranges = np.full(BEAMS, 10.0)
    with pytest.raises(ValueError, match="ranges"):
        getattr(scan, method)(ranges, Resizes(ranges))
    ranges = np.full(BEAMS, 10.0)
    speed: Any = Resizes(ranges)
    assert ttc_fast.ittc(ranges, closing_speed=speed).tolist() == [2.0]


def test_a_message_cannot_be_resized_under_its_view() -> None:
    fields = [SimpleNamespace(name=name, offset=4 * i, datatype=7, count=1) for i, name in enumerate("xyz")]
    data: Any = array.array("B", np.ones((1000, 3), np.float32).tobytes())
    msg: Any = SimpleNamespace(
        height=1,
        width=1000,
        fields=fields,
        is_bigendian=False,
        point_step=12,
        row_step=12_000,
        data=data,
        is_dense=True,
    )
    points = ttc_fast.from_pointcloud2(msg)
    with pytest.raises(BufferError):
        del data[16:]
    assert ttc_fast.robust_min_x(points).candidates == 1000


ESTIMATORS: list[Any] = [
    ttc_fast.Minimum(),
    ttc_fast.KthSmallest(20),
    ttc_fast.MeanOfLowest(5),
    ttc_fast.Quantile(0.5),
    ttc_fast.Supported(5, 0.1),
    ttc_fast.Cluster(0.5, 3),
]


@pytest.mark.parametrize("other", [np.nan, -50.0], ids=["NaN", "behind"])
def test_a_cloud_that_is_written_to_meanwhile_is_a_mixed_cloud(other: float) -> None:
    """Never a panic, never a point outside the gate."""
    rng = np.random.default_rng(1)
    kept = np.column_stack([rng.uniform(1.0, 60.0, 20_000), rng.uniform(-2.0, 2.0, (20_000, 2))])
    points = kept.copy()
    done = threading.Event()

    def write() -> None:
        while not done.is_set():
            points[:, 0] = other
            points[:] = kept

    writer = threading.Thread(target=write)
    writer.start()
    try:
        for _ in range(60):
            for estimator in ESTIMATORS:
                found = ttc_fast.robust_min_x(points, estimator=estimator)
                if found.detection is ttc_fast.Detection.FOUND:
                    assert 0.0 <= found.nearest_x <= found.x <= 60.0
    finally:
        done.set()
        writer.join()


def _in_a_child(points: Any, results: Any) -> None:
    results.put(ttc_fast.robust_min_x(points, threads=2).x)


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="this system cannot fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning")
def test_a_forked_child_does_not_wait_for_threads_that_it_has_not_got() -> None:
    points = (np.random.default_rng(0).uniform(1.0, 60.0, (400_000, 3)) * [1.0, 0.01, 1.0]).astype(np.float32)
    expected = ttc_fast.robust_min_x(points, threads=2).x
    fork = multiprocessing.get_context("fork")
    results = fork.Queue()
    child = fork.Process(target=_in_a_child, args=(points, results), daemon=True)
    child.start()
    assert results.get(timeout=60) == expected
    child.join(60)


@pytest.mark.parametrize(
    "settings",
    [
        (ttc_fast.Gate(x=(0.0, 1.0)), ttc_fast.Gate(x=(-0.0, 1.0))),
        (ttc_fast.Quantile(0.0), ttc_fast.Quantile(-0.0)),
        (ttc_fast.Supported(1, 0.0), ttc_fast.Supported(1, -0.0)),
    ],
    ids=str,
)
def test_equal_settings_have_equal_hashes(settings: tuple[Any, Any]) -> None:
    one, other = settings
    assert one == other
    assert hash(one) == hash(other)


def test_the_search_holds_at_denormal_offsets_and_speeds() -> None:
    """Where products lose their digits, the nearest is still the nearest."""
    least = float(np.float32(1e-45))
    scan = ttc_fast.ScanTTC(0.0, math.pi / 2, 2, outline=(-1.0, 3e-4 * least, -1.0, 0.4 * least), min_closing_speed=0.0)
    assert scan.nearest(np.array([0.7 * least / math.cos(math.pi / 2), least], "f4"), 1.0).beam == 1
    scan = ttc_fast.ScanTTC(0.0, math.acos(0.6), 2, min_closing_speed=0.0)
    assert scan.nearest(np.array([1e-20, 0.61e-20]), 5e-324).beam == 1


def test_a_road_is_below_the_sensor() -> None:
    x, y = np.meshgrid(np.arange(1.0, 30.0, 0.3), np.arange(-6.0, 6.0, 0.3))
    ceiling = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 0.25)])
    assert ttc_fast.fit_road(ceiling, sensor_height=0.2).status is ttc_fast.RoadStatus.NOT_FOUND
