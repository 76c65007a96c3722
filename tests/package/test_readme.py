"""The examples of the README and of the documents beside it run, and print what their comments say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

README = Path(__file__).parents[2] / "README.md"
if not README.exists():
    pytest.skip("the README is not beside the tests", allow_module_level=True)
DOCUMENTS = [README, *(README.parent / "docs" / name for name in ("camera.md", "tracking.md"))]
EXAMPLES = [
    pytest.param(example, id=f"{document.name}: {example.splitlines()[2]}")
    for document in DOCUMENTS
    for example in re.findall(r"```python\n(.*?)```", document.read_text(encoding="utf-8"), flags=re.DOTALL)
]


def test_there_are_examples() -> None:
    assert len(EXAMPLES) >= 4


@pytest.mark.parametrize("example", EXAMPLES)
def test_an_example(example: str, capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(example, "example", "exec"), {})
    printed = capsys.readouterr().out.splitlines()
    prints = [line for line in example.splitlines() if line.startswith("print(")]
    assert len(printed) == len(prints)
    for line, output in zip(prints, printed, strict=True):
        if "#" in line:
            assert output == line.split("#")[1].strip()
