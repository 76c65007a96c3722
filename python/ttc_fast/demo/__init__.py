"""The main job, from end to end: a recorded log through ``ScanTTC.nearest``, as a table and a picture."""

from pathlib import Path

SAMPLE = Path(__file__).parent.parent / "samples" / "approach.npz"
"""The approach that the package ships: made by the project, a small car that brakes late for a parked box."""
