"""How bad input is refused, and values that no argument expects."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from ttc_fast import ScanTTC

if TYPE_CHECKING:
    from collections.abc import Callable


def message(error: BaseException) -> str:
    """Return all that a traceback shows of an exception: pyo3 names an argument that it converts in a note."""
    return "\n".join([str(error), *getattr(error, "__notes__", [])])


def refused(kind: type[Exception], argument: str, call: Callable[..., Any], *args: Any, **kwargs: Any) -> str:
    """Return the message of exactly this kind of exception, which has to name the argument."""
    with pytest.raises(kind) as caught:
        call(*args, **kwargs)
    assert caught.type is kind
    assert argument in message(caught.value)
    return message(caught.value)


class OwnError(Exception):
    """The exception that an object of the caller raises by itself; it may pass through."""


class Contrary:
    """An object whose every conversion fails with an error of its own."""

    def fail(self, *args: Any, **kwargs: Any) -> Any:
        raise OwnError

    __float__ = __index__ = __len__ = __iter__ = __array__ = __bool__ = __eq__ = fail
    __hash__ = None  # type: ignore[assignment]


class FalseRank:
    """An object that says that it has a rank, and has none."""

    ndim = "two"
    shape = None


ODD: dict[str, Any] = {
    "None": None,
    "True": True,
    "2**70": 2**70,
    "-2**70": -(2**70),
    "10**400": 10**400,
    "nan": math.nan,
    "-inf": -math.inf,
    "1e308": 1e308,
    "5e-324": 5e-324,
    "1j": 1j,
    "empty text": "",
    "text": "1",
    "surrogate": "\ud800",
    "bytes": b"1",
    "list": [],
    "dict": {},
    "nested": [[1.0], [2.0, 3.0]],
    "self": ScanTTC(-0.1, 0.1, 3),
    "0-d": np.array(1.0),
    "0-d object": np.array(None),
    "empty array": np.empty(0),
    "objects": np.array([None, "x", 1.0]),
    "NaT": np.datetime64("NaT"),
    "Contrary": Contrary(),
    "FalseRank": FalseRank(),
    "function": len,
    "type": int,
}


Targets = dict[str, tuple["Callable[..., Any]", dict[str, Any]]]
"""Callables by name, each with arguments that it takes."""


def every_argument(targets: Targets) -> pytest.MarkDecorator:
    """Parametrise a test by each argument of each callable: ``call``, ``arguments``, and ``odd``, its name."""
    return pytest.mark.parametrize(
        ("call", "arguments", "odd"),
        [(call, arguments, odd) for call, arguments in targets.values() for odd in arguments],
        ids=[f"{name}({argument}=)" for name, (_, arguments) in targets.items() for argument in arguments],
    )


def taken_or_refused(
    call: Callable[..., Any], arguments: dict[str, Any], odd: str, *also: str, passes: type[Exception] = OwnError
) -> None:
    """Hold a call to take each odd value for an argument, or to refuse it by its name or by one of ``also``.

    Nothing else may happen but ``passes``: no panic, no exception of another kind or without the argument's name.
    """
    for name, value in ODD.items():
        try:
            call(**{**arguments, odd: value})
        except (OwnError, passes):
            pass
        except (TypeError, ValueError, OverflowError) as error:
            said = message(error)
            assert any(each in said for each in (odd, *also)), f"{name}: {said}"
