"""How the replay of one of many logs ended."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from ttc_fast import __version__
from ttc_fast._exit_codes import DONE, PARTIAL, UNREADABLE

if TYPE_CHECKING:
    from ttc_fast.plotting.history import History
    from ttc_fast.replay.summary import Summary


class Chapter(NamedTuple):
    """What a report shows of a log.

    Attributes
    ----------
    name : str
        The name of the log.
    history : History
        The rows to draw.
    pictures : dict of int to bytes
        The pictures of frames, as WebP.
    key_frame : int or None
        The frame that is shown of the log as a whole.
    """

    name: str
    history: History
    pictures: dict[int, bytes]
    key_frame: int | None


@dataclass(frozen=True)
class Made:
    """What a part was made of: while that is the same, the log is done.

    Attributes
    ----------
    size : int
        The bytes of the log.
    modified : float
        When it was changed, s since 1970.
    settings : str
        A digest of the settings.
    version : str
        The version of ttc_fast.
    """

    size: int
    modified: float
    settings: str
    version: str = __version__


@dataclass(frozen=True)
class Replayed:
    """How the replay of one of many logs ended.

    Attributes
    ----------
    log : str
        The log: its absolute path, or its URL.
    summary : Summary
        What its rows come to. ``summary.lost`` is the reason where something was lost.
    exit_code : int
        With which code ``ttc-fast replay`` of this log ends: 0, or 3 where nothing could be read, 5 where a part was
        lost, 2 where a setting makes no sense for it, 1 where it failed otherwise, 130 where it was interrupted.
    made : Made or None
        What it was made of; None where it was not replayed, or not into a dataset.
    skipped : bool
        Whether an earlier run had done it.
    chapter : Chapter or None
        What a report shows of it, where one is to be written.
    """

    log: str
    summary: Summary
    exit_code: int
    made: Made | None = None
    skipped: bool = field(default=False, compare=False)
    chapter: Chapter | None = field(default=None, compare=False, repr=False)


def exit_code_of(summary: Summary) -> int:
    """Return with which code the replay of a log ends that was read as far as it can be."""
    if summary.frames:
        return PARTIAL if summary.lost else DONE
    return UNREADABLE
