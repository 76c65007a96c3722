"""The main job, from end to end: a recorded log in, a table and a picture of its time-to-collision out.

What all demos share is here; what a scan or a cloud needs is in ``scans`` and ``clouds``.
"""

from pathlib import Path

_FOLDER = Path(__file__).parent.parent / "samples"

SAMPLES = {"scans": _FOLDER / "approach.npz", "clouds": _FOLDER / "following.npz"}
"""The logs that the package ships, made by the project: laser scans of a small car that brakes late for a parked box,
and point clouds of a car that follows another one, which brakes."""

_NAMES = {SAMPLES["scans"]: "simulated approach", SAMPLES["clouds"]: "simulated car ahead"}


def name_of(path: Path) -> str:
    """Name a log above its picture: the samples as what they are, others by their file."""
    return _NAMES.get(path, path.resolve().name)
