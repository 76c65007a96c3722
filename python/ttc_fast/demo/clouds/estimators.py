"""Estimators by a short name, as a command line gives them: ``kth:10``."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from ttc_fast import Cluster, InterquartileFence, KthSmallest, MeanOfLowest, Minimum, Quantile, Supported

if TYPE_CHECKING:
    from collections.abc import Callable

Estimator: TypeAlias = Minimum | KthSmallest | Quantile | MeanOfLowest | InterquartileFence | Supported | Cluster

# What makes each, and how its settings are read.
ESTIMATORS: dict[str, tuple[Callable[..., Estimator], dict[str, Callable[[str], float]]]] = {
    "minimum": (Minimum, {}),
    "kth": (KthSmallest, {"K": int}),
    "quantile": (Quantile, {"Q": float}),
    "mean": (MeanOfLowest, {"K": int}),
    "fence": (InterquartileFence, {"FACTOR": float}),
    "supported": (Supported, {"POINTS": int, "GAP": float}),
    "cluster": (Cluster, {"TOLERANCE": float, "POINTS": int}),
}


def usage(name: str) -> str:
    """Show how an estimator is written, such as ``kth:K``."""
    settings = ",".join(ESTIMATORS[name][1])
    return f"{name}:{settings}" if settings else name


USAGES = ", ".join(usage(name) for name in ESTIMATORS)


def read_estimator(text: str) -> Estimator:
    """Make the estimator that a text describes.

    Parameters
    ----------
    text : str
        A name, a colon and the settings with commas between them.

    Returns
    -------
    estimator object

    Raises
    ------
    ValueError
        If there is none of that name, or the settings make no sense.

    Examples
    --------
    >>> from ttc_fast.demo.clouds.estimators import read_estimator
    >>> read_estimator("cluster:0.2,10")
    Cluster(tolerance=0.2, min_points=10)
    """
    name, _, settings = text.partition(":")
    if name not in ESTIMATORS:
        raise ValueError(f"must be one of {USAGES}, got {text!r}")
    make, readers = ESTIMATORS[name]
    given = settings.split(",") if settings else []
    if len(given) != len(readers):
        raise ValueError(f"must be written {usage(name)}, got {text!r}")
    try:
        return make(*(read(setting) for read, setting in zip(readers.values(), given, strict=True)))
    except (ValueError, OverflowError) as error:
        raise ValueError(f"must be written {usage(name)}, got {text!r}: {error}") from error
