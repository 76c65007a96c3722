"""Every path that docs/architecture.md names exists, and every function that it names in a file is defined there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCUMENT = ROOT / "docs" / "architecture.md"
if not DOCUMENT.exists():
    pytest.skip("the documents are not beside the tests", allow_module_level=True)
TEXT = DOCUMENT.read_text(encoding="utf-8")
PATHS = sorted(set(re.findall(r"\b(?:rust|python|ros|tests|evaluation|benches|tools)/[\w/.]*\w", TEXT)))
NAMES = sorted(set(re.findall(r"`([\w/]+\.(?:py|rs)): ([\w.:]+)`", TEXT)))


def test_it_names_files_and_functions() -> None:
    assert len(PATHS) > 40
    assert len(NAMES) > 60


@pytest.mark.parametrize("path", PATHS)
def test_a_path_exists(path: str) -> None:
    assert (ROOT / path).exists()


@pytest.mark.parametrize(("path", "name"), NAMES)
def test_a_name_is_defined_in_its_file(path: str, name: str) -> None:
    text = (ROOT / path).read_text(encoding="utf-8")
    *owner, last = re.split(r"::|\.", name)
    assert re.search(rf"\b(fn|def|class|struct|enum|trait) {last}\b", text)
    for each in owner:
        assert re.search(rf"\b(class|struct|enum|trait|impl\b.*) {each}\b", text)
