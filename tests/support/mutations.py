"""Damage to the bytes of a file, as disks, networks and people do it: flipped, cut, doubled, inserted, moved."""

from __future__ import annotations

import hashlib
import os
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

SEED = int(os.environ.get("TTC_FAST_SEED", "0"))
CORPUS = Path(__file__).parents[1] / "logs" / "corpus"
"""Damaged logs that were once read wrongly."""

WORDS = (b"\xff" * 4, bytes(4), b"\xff\xff\xff\x7f", b"\0\0\0\x80", b"-1", b"nan", b"inf", b"1e999", b"9" * 40, b"\n")
"""Bytes that lengths, counts and numbers are made of where something goes wrong."""


def mutations(content: bytes, count: int, seed: int) -> Iterator[bytes]:
    """Yield the content damaged in one to three places, ``count`` times, the same for the same seeds."""
    rng = np.random.default_rng(SEED + seed)
    for _ in range(count):
        damaged = bytearray(content)
        for _ in range(int(rng.integers(1, 4))):
            _damage(damaged, rng)
        yield bytes(damaged)


@contextmanager
def kept(path: Path) -> Iterator[None]:
    """Put a log into the folder that ``TTC_FAST_CORPUS`` names, if what is done with it fails."""
    try:
        yield
    except Exception:
        if folder := os.environ.get("TTC_FAST_CORPUS"):
            content = path.read_bytes()
            name = hashlib.sha256(content).hexdigest()[:12] + "." + path.name.partition(".")[2]
            Path(folder).joinpath(name).write_bytes(content)
        raise


def _damage(content: bytearray, rng: np.random.Generator) -> None:
    """Damage one place. Half of the places are near the beginning or the end, where the structure is."""
    size = len(content)
    within = size if rng.random() < 0.5 else min(size, 600)
    at = int(rng.integers(0, within + 1))
    at = at if rng.random() < 0.6 else size - at
    length = int(rng.integers(1, 9))
    match int(rng.integers(0, 7)):
        case 0:
            content[at : at + 1] = bytes([int(rng.integers(0, 256))])
        case 1 if at < size:
            content[at] ^= 1 << int(rng.integers(0, 8))
        case 2:
            word = WORDS[int(rng.integers(0, len(WORDS)))]
            content[at : at + len(word)] = word
        case 3:
            content[at:at] = WORDS[int(rng.integers(0, len(WORDS)))]
        case 4:
            del content[at : at + length]
        case 5:
            content[at:at] = content[at : at + 8 * length]
        case 6 if rng.random() < 0.3:
            del content[at:]
