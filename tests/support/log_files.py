"""Small logs of every format that is no bag, by the names of their files."""

from __future__ import annotations

import gzip
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

CARMEN = b"# a comment\nPARAM robot_width 0.5\n" + b"".join(
    b"ODOM %f 0 0 0 0 0 %f host %f\nFLASER 5 1 2 81.91 2 1 %f 0 0 0 0 0 %f host %f\n"
    % (i * 0.5, i * 0.5, i * 0.5, i * 0.5, i * 0.5, i * 0.5)
    for i in range(50)
)
TABLE = b"stamp,distance\n" + b"".join(b"%f,%f\n" % (i / 10, 20 - i / 10) for i in range(100))
PCD = b"""# .PCD v0.7 - Point Cloud Data file format
VERSION 0.7
FIELDS x y z intensity
SIZE 4 4 4 4
TYPE F F F F
COUNT 1 1 1 1
WIDTH 40
HEIGHT 1
VIEWPOINT 0 0 0 1 0 0 0
POINTS 40
DATA """
ROWS = np.arange(160, dtype="<f4").reshape(40, 4)
FILES = {
    "log.log": CARMEN,
    "log.log.gz": gzip.compress(CARMEN),
    "log.csv": TABLE,
    "a.pcd": PCD + b"binary\n" + ROWS.tobytes(),
    "b.pcd": PCD + b"ascii\n" + "\n".join(" ".join(map(str, row)) for row in ROWS).encode(),
    "b.pcd.gz": gzip.compress(PCD + b"binary\n" + ROWS.tobytes()),
    "a.bin": ROWS.tobytes(),
    "a.bin.gz": gzip.compress(ROWS.tobytes()),
    "a.pcd.bin": ROWS.tobytes(),
}


def pcd_folder(folder: Path, clouds: list[NDArray[Any]]) -> Path:
    """Write clouds as a folder of PCD files, which say no height."""
    folder.mkdir()
    for number, points in enumerate(clouds):
        size = f"WIDTH {len(points)}\nHEIGHT 1\nPOINTS {len(points)}\nDATA binary\n"
        head = f"VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n{size}"
        (folder / f"{number:04d}.pcd").write_bytes(head.encode() + points.astype("<f4").tobytes())
    return folder
