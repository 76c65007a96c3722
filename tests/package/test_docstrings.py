"""Docstrings are part of the interface: they have the sections a caller looks for, and their examples are true."""

from __future__ import annotations

import doctest
import enum
import importlib
import inspect
import pkgutil
import re
from typing import TYPE_CHECKING, Any

import pytest

import ttc_fast

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

RESULTS = {
    "CloudTTC",
    "Decision",
    "Counts",
    "CountsBatch",
    "KeypointTTC",
    "MinX",
    "Nearest",
    "NearestBatch",
    "NearestPoint",
    "NearestPointBatch",
    "RangeRateNearest",
    "RoadFit",
    "TrackedTTC",
}
"""Classes that only the package makes: they have attributes instead of parameters."""
PUBLIC = {name: getattr(ttc_fast, name) for name in ttc_fast.__all__ if not isinstance(getattr(ttc_fast, name), str)}


def is_enum(target: Any) -> bool:
    return inspect.isclass(target) and issubclass(target, enum.Enum)


def members(cls: type) -> Iterator[tuple[str, Any]]:
    """The public methods and properties that a class defines itself."""
    for name, member in vars(cls).items():
        if not name.startswith("_"):
            yield name, member


def documented() -> Iterator[tuple[str, Any]]:
    """Every public object that has a docstring of its own to be judged."""
    for name, target in PUBLIC.items():
        yield name, target
        if inspect.isclass(target) and not is_enum(target):
            for member, _ in members(target):
                yield f"{name}.{member}", getattr(target, member)


def callables() -> Iterator[tuple[str, Callable[..., Any]]]:
    """What a caller calls with arguments: functions, constructors and methods."""
    for name, target in documented():
        makes_no_call = name in RESULTS or name == "NoDataError" or is_enum(target) or not callable(target)
        if not makes_no_call:
            yield name, target


DOCUMENTED = dict(documented())
CALLABLES = dict(callables())
MODULES = [
    module.name
    for module in pkgutil.walk_packages(ttc_fast.__path__, "ttc_fast.")
    if not module.name.endswith(("._core", ".__main__"))
]


def sections(target: Any) -> dict[str, str]:
    """The numpydoc sections of a docstring, by title."""
    parts = re.split(r"^([A-Z]\w+)\n-{3,}\n", inspect.getdoc(target) or "", flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def run(test: doctest.DocTest) -> None:
    report: list[str] = []
    failures, _ = doctest.DocTestRunner(verbose=False).run(test, out=report.append)
    assert failures == 0, "".join(report)


def test_the_lists_are_not_empty() -> None:
    """What is judged below is found by looking; these are among it for certain."""
    assert {"ScanTTC", "ScanTTC.min", "ScanTTC.angles", "Nearest", "ittc", "Status", "NoDataError"} <= set(DOCUMENTED)
    assert {"ScanTTC", "ScanTTC.min", "ScanTTC.nearest", "ScanTTC.per_beam", "ScanTTC.from_message"} <= set(CALLABLES)
    assert {"ittc", "KthSmallest", "NeighbourSupport", "closing_speed_from_ego_velocity"} <= set(CALLABLES)
    assert {"ttc_fast.signs", "ttc_fast.status", "ttc_fast.reference.scan"} <= set(MODULES)


@pytest.mark.parametrize("name", [name for name in DOCUMENTED if "." not in name])
def test_every_public_object_says_what_it_is(name: str) -> None:
    first = (inspect.getdoc(DOCUMENTED[name]) or "").split("\n")[0]
    assert first.endswith(".")
    assert len(first) > 10


@pytest.mark.parametrize("name", CALLABLES)
def test_every_parameter_is_described(name: str) -> None:
    described = sections(CALLABLES[name]).get("Parameters", "")
    headings = " ".join(re.findall(r"^\S.*$", described, flags=re.MULTILINE))
    for parameter in inspect.signature(CALLABLES[name]).parameters.values():
        if parameter.name != "self":
            assert re.search(rf"(?<!\w){parameter.name}(?!\w)", headings), parameter


@pytest.mark.parametrize("name", CALLABLES)
def test_results_errors_and_examples_are_described(name: str) -> None:
    expected = {"Examples"}
    takes = [name for name in inspect.signature(CALLABLES[name]).parameters if name != "self"]
    if takes:
        expected |= {"Parameters"}
    if not inspect.isclass(CALLABLES[name]):
        expected |= {"Returns"}
    takes_anything = inspect.isfunction(CALLABLES[name]) or hasattr(CALLABLES[name], "_fields")
    if takes and not takes_anything:  # the kernels, all of which refuse some arguments
        expected |= {"Raises"}
    assert expected <= set(sections(CALLABLES[name]))


@pytest.mark.parametrize("name", ["ittc", "ScanTTC"])
def test_formulae_name_their_source(name: str) -> None:
    assert "F1TENTH" in sections(PUBLIC[name])["Notes"]


SOURCES = {
    "ttc_constant_velocity": "Hayward",
    "ttc_constant_acceleration": "Ozbay",
    "time_headway": "Vogel",
    "deceleration_to_avoid_crash": "Cooper",
    "stopping_distance": "AASHTO",
    "rss_longitudinal_distance": "Shalev-Shwartz",
    "DistanceTracker": "Fieller",
}


@pytest.mark.parametrize("name", SOURCES)
def test_formulae_of_motion_name_theirs(name: str) -> None:
    assert SOURCES[name] in sections(PUBLIC[name])["Notes"]


@pytest.mark.parametrize(
    "name", [name for name, target in PUBLIC.items() if inspect.isclass(target) and not is_enum(target)]
)
def test_every_attribute_is_described(name: str) -> None:
    """By itself, in its class, or in the class that this one is a batch of."""
    doc = inspect.getdoc(PUBLIC[name]) or ""
    doc += "".join(inspect.getdoc(PUBLIC[single]) or "" for single in re.findall(r"``(\w+)`` of a batch", doc))
    for member, value in members(PUBLIC[name]):
        assert inspect.getdoc(value) or re.search(rf"^(\w+, )*{member}\b.* :", doc, flags=re.MULTILINE), member


def examples() -> Iterator[Any]:
    for name, target in DOCUMENTED.items():
        doc = inspect.getdoc(target) or ""
        if ">>>" in doc:
            yield pytest.param(doc, name, id=name)


@pytest.mark.parametrize(("doc", "name"), list(examples()))
def test_examples_of_public_objects(doc: str, name: str) -> None:
    """Each by itself, with nothing imported but by the example."""
    run(doctest.DocTestParser().get_doctest(doc, {}, name, None, 0))


@pytest.mark.parametrize("name", MODULES)
def test_examples_of_modules(name: str) -> None:
    try:
        module = importlib.import_module(name)
    except ModuleNotFoundError as error:  # the adapters of ROS need what is in no package registry, the filter an extra
        if not name.startswith(("ttc_fast.ros.", "ttc_fast.gym")) or (error.name or "").startswith("ttc_fast"):
            raise
        pytest.skip(f"needs {error.name}")
    if name == "ttc_fast.replay.table":
        pytest.importorskip("pandas", reason="needs the extra pandas")
    for test in doctest.DocTestFinder().find(module):
        run(test)
