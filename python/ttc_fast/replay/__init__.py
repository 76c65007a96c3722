"""Recorded logs go through the code that brakes, and give a row for each frame, a summary and a picture."""

from ttc_fast.replay.many import Progress, replay_many
from ttc_fast.replay.output import Files
from ttc_fast.replay.replayed import Replayed
from ttc_fast.replay.row import Row
from ttc_fast.replay.run import Replay, sample
from ttc_fast.replay.settings import Settings
from ttc_fast.replay.summary import Event, Summary
from ttc_fast.replay.table import to_pandas

__all__ = [
    "Event",
    "Files",
    "Progress",
    "Replay",
    "Replayed",
    "Row",
    "Settings",
    "Summary",
    "replay_many",
    "sample",
    "to_pandas",
]
