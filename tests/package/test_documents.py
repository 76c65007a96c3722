"""The ```python blocks of every document run, from the first to the last in one namespace, and print what they say.

A block gets the files that its document names: ``FILES`` makes those, in a folder where the document runs. Where a line
of print() ends in a comment, that is what it printed last.
"""

from __future__ import annotations

import ast
import builtins
import importlib
import json
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support import log_files
from tests.support.bags import drive, write
from ttc_fast.logs import CloudFrame, open_log
from ttc_fast.replay import sample

if TYPE_CHECKING:
    from collections.abc import Callable

ROOT = Path(__file__).parents[2]
if not (ROOT / "README.md").exists():
    pytest.skip("the documents are not beside the tests", allow_module_level=True)
BLOCK = re.compile(r"^```python\n(.*?)^```", flags=re.DOTALL | re.MULTILINE)
DOCUMENTS = {
    str(path.relative_to(ROOT)): text
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
    if BLOCK.search(text := path.read_text(encoding="utf-8"))
}
GYM = """
import gymnasium, numpy as np

class Wall(gymnasium.Env):
    action_space = gymnasium.spaces.Box(-1.0, 20.0, (2,), np.float64)
    observation_space = gymnasium.spaces.Dict()
    observation = {"scan": np.full(1080, 3.0), "linear_vel_x": 1.0}

    def reset(self, **how):
        return self.observation, {}

    def step(self, action):
        return self.observation, 0.0, False, False, {}

gymnasium.register("f1tenth-v0", Wall, disable_env_checker=True)
"""


def bag(path: Path) -> None:
    path.parent.mkdir(exist_ok=True)
    write(path.parent, "bag", drive(40)).rename(path)


def clouds(folder: Path) -> None:
    """The clouds of a sample as KITTI has them."""
    folder.mkdir(parents=True)
    for number, frame in enumerate(open_log(sample("clouds"))):
        assert isinstance(frame, CloudFrame)
        rows = np.zeros((len(frame.points), 4), np.float32)
        rows[:, :3] = frame.points[:, :3]
        rows.tofile(folder / f"{number:010d}.bin")


FILES: dict[str, Callable[[Path], Any]] = {
    "drive.bag": bag,
    "drive.log.gz": lambda path: path.write_bytes(log_files.FILES["log.log.gz"]),
    "velodyne": clouds,
    "f1tenth_gym.py": lambda path: path.write_text(GYM),
}


@pytest.mark.parametrize("name", DOCUMENTS)
def test_the_examples_of_a_document(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = DOCUMENTS[name]
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    for file, make in FILES.items():
        if file.removesuffix(".py") in text:
            make(tmp_path / file)
    printed: dict[int, str] = {}

    def recording_print(*values: Any, **how: Any) -> None:
        frame = sys._getframe(1)
        if frame.f_code.co_filename == name:
            printed[frame.f_lineno] = how.get("sep", " ").join(map(str, values))
        builtins.print(*values, **how)

    namespace: dict[str, Any] = {"print": recording_print, "__name__": "document"}
    for block in BLOCK.finditer(text):
        above = "\n" * text.count("\n", 0, block.start(1))  # so that tracebacks have the lines of the document
        exec(compile(above + block[1], name, "exec"), namespace)
    promised = {
        number: line.partition("  # ")[2]
        for number, line in enumerate(text.splitlines(), 1)
        if line.lstrip().startswith("print(") and "  # " in line
    }
    assert {number: printed.get(number) for number in promised} == promised


def test_every_public_name_has_a_place_in_the_reference() -> None:
    pages = importlib.import_module("tools.documentation").made_pages()
    assert "::: ttc_fast.ScanTTC" in pages["reference/scans.md"]
    assert "`range_max` | `inf` | m |" in pages["reference/settings.md"]
    assert "| `CLOSING` | 2 |" in pages["reference/statuses.md"]
    assert "](logs.md" in pages["index.md"]


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its cells run in order, print what it holds, and show what a notebook can show."""
    namespace: dict[str, Any] = {}
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] != "code":
            continue
        *statements, last = ast.parse("".join(cell["source"])).body
        shows = isinstance(last, ast.Expr) and not ast.unparse(last).startswith("print(")
        exec(compile(ast.Module([*statements, *([] if shows else [last])], []), path.name, "exec"), namespace)
        held = {kind: value for output in cell["outputs"] for kind, value in output.get("data", {}).items()}
        if shows and isinstance(last, ast.Expr):
            shown = eval(compile(ast.Expression(last.value), path.name, "eval"), namespace)
            assert "image/png" not in held or shown._repr_png_().startswith(b"\x89PNG")
            assert "text/html" not in held or "".join(held["text/html"]) == shown._repr_html_()
        printed = "".join(text for output in cell["outputs"] for text in output.get("text", []))
        assert capsys.readouterr().out == printed
