"""Folders of rosbag2: the .db3 or .mcap files that one recording was split into.

``metadata.yaml`` is not needed: the files say the same, and those of a recorder that crashed have none.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from ttc_fast.logs.db3 import Database
from ttc_fast.logs.log import LogError
from ttc_fast.logs.mcap import McapFile

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path

    from ttc_fast.logs.container import Container, Message, Topic
    from ttc_fast.logs.log import ReadErrors

SUFFIXES = (".db3", ".mcap")
PACKED = tuple(f"{suffix}.zstd" for suffix in SUFFIXES)


class BagFolder:
    """A folder of rosbag2, its files one after another.

    Parameters
    ----------
    path : Path
        Of the folder.

    Raises
    ------
    LogError
        If a file cannot be opened, or all are compressed.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        files = [file for file in path.iterdir() if file.name.lower().endswith(SUFFIXES)]
        if not files:
            packed = next((file.name for file in path.iterdir() if file.name.lower().endswith(PACKED)), None)
            how = f"unpack its files first: zstd -d {packed}" if packed else f"it has no {' or '.join(SUFFIXES)} file"
            raise LogError(path, f"cannot be read as a folder of rosbag2; {how}")
        files.sort(key=_in_order)
        self._parts: list[Container] = [_open(file) for file in files]
        self.topics = self._all_topics()

    def messages(self, names: Collection[str], errors: ReadErrors) -> Iterator[Message]:
        """Read the messages of these topics, and note what is damaged."""
        for part in self._parts:
            errors.part = part.path.name
            yield from part.messages(names, errors)

    def _all_topics(self) -> list[Topic]:
        found: dict[str, Topic] = {}
        for part in self._parts:
            for topic in part.topics:
                found[topic.name] = topic.joined(found.get(topic.name))
        return list(found.values())


def is_bag_folder(path: Path) -> bool:
    """Whether a folder looks like one of rosbag2."""
    return any(file.name.lower().endswith((*SUFFIXES, *PACKED)) for file in path.iterdir())


def _open(file: Path) -> Container:
    return Database(file) if file.suffix.lower() == ".db3" else McapFile(file)


def _in_order(file: Path) -> list[tuple[int, str]]:
    """Sort by the numbers in the name, so that part 10 comes after part 9."""
    return [(int(digits or -1), text) for text, digits in re.findall(r"(\D*)(\d*)", file.name)]
