"""Reports in a real Chromium: an empty console, tables that sort, a click that shows the frame, curves that zoom."""

import base64
import json
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.bags import drive, write
from ttc_fast.cli import main
from ttc_fast.replay import Files, Replay, replay_many, sample

pytest.importorskip("bokeh", reason="needs the extra report: pip install '.[report]', or make fleet")
pytestmark = pytest.mark.filterwarnings("default")  # those of Bokeh
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
in_browser = pytest.mark.skipif(
    CHROMIUM is None or find_spec("playwright") is None, reason="needs Chromium, and playwright: make fleet"
)
MOST_BYTES = 5_000_000
READY = """new Promise(done => {
  const look = () => document.querySelector("tr.chosen") ? setTimeout(done, 200) : setTimeout(look, 20); look(); })"""


@contextmanager
def opened(report: Path) -> Iterator[tuple[Any, list[str]]]:
    """Yield a report in a browser without a screen, and what is worse than an information: it must be empty."""
    problems: list[str] = []

    def note(problem: str, is_one: bool = True) -> None:
        problems.extend([problem] * is_one)

    with import_module("playwright.sync_api").sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1600, "height": 1000})
        page.on("console", lambda said: note(said.text, said.type in ("error", "warning", "assert")))
        page.on("pageerror", lambda error: note(str(error)))
        page.on("request", lambda asked: note(asked.url, not asked.url.startswith(("file:", "data:", "blob:"))))
        page.goto(report.as_uri())
        page.evaluate(READY)
        yield page, problems
        browser.close()


def data_of(report: Path) -> list[dict[str, Any]]:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', report.read_text("utf-8"))
    assert found is not None
    data: list[dict[str, Any]] = json.loads(found.group(1))
    return data


@pytest.fixture(scope="module")
def several(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a report of ten logs, of which one is damaged and one cannot be read."""
    folder = tmp_path_factory.mktemp("several")
    samples = [sample("scans"), sample("clouds")] * 4
    logs = [shutil.copy(log, folder / f"{i}-{log.name}") for i, log in enumerate(samples)]
    bag = write(folder, "bag", drive(400))
    damaged = folder / "<b>damaged & cut.bag"
    damaged.write_bytes(bag.read_bytes()[: bag.stat().st_size // 2])
    (folder / "empty.bag").touch()
    report = folder / "out" / "report.html"
    replay_many([*logs, damaged, folder / "empty.bag"], files=Files(report=report), jobs=1)
    assert list(report.parent.iterdir()) == [report]
    return report


def test_ten_logs_are_below_five_megabytes_and_hold_the_rows(several: Path) -> None:
    assert several.stat().st_size < MOST_BYTES
    data = data_of(several)
    assert len(data) == 10
    rows = list(Replay(sample("scans")))
    stored = {name: np.frombuffer(base64.b64decode(text), "<f4") for name, text in data[0]["rows"].items()}
    np.testing.assert_allclose(stored["x"], [row.stamp for row in rows], rtol=1e-6)
    ttc = np.where(np.isnan(stored["isolated"]), stored["ttc"], stored["isolated"])
    finite = np.isfinite(ttc)
    np.testing.assert_allclose(ttc[finite], np.array([row.ttc for row in rows])[finite], rtol=1e-6)
    assert data[8]["rows"]["x"]  # what could be read of the damaged one
    assert not data[9]["rows"]["x"]
    assert "empty.bag" in data[9]["without"]


@in_browser
def test_tables_sort_and_a_click_shows_the_frame(several: Path, tmp_path: Path) -> None:
    with opened(several) as (page, problems):
        events = "[...document.querySelectorAll('table')[0].tBodies[0].rows]"
        count = page.evaluate(f"{events}.length")
        assert count >= 9
        assert page.evaluate("document.querySelectorAll('table')[1].tBodies[0].rows.length") == 10
        assert "<b>damaged & cut.bag" in page.evaluate("document.body.innerText")
        for heading in range(11):
            for name, sign in (("ascending", 1), ("descending", -1)):
                page.evaluate(f"document.querySelectorAll('table')[0].tHead.rows[0].cells[{heading}].click()")
                assert page.evaluate(f"document.querySelectorAll('th')[{heading}].ariaSort") == name
                column = f"{events}.map(row => row.cells[{heading}])"
                if heading < 3:
                    texts = page.evaluate(f"{column}.map(cell => cell.textContent)")
                    assert texts == sorted(texts, reverse=sign < 0)
                    continue
                numbers = np.array(page.evaluate(f"{column}.map(cell => cell.dataset.value)"), float)
                assert len(numbers) == count
                known = numbers[~np.isnan(numbers)]
                assert np.isnan(numbers[len(known) :]).all()  # what is not known comes last
                with np.errstate(invalid="ignore"):
                    assert not (sign * np.diff(known) < 0).any()
        shown = set()
        for i in range(count):
            page.evaluate(f"{events}[{i}].click()")
            page.evaluate("document.querySelector('#frame img')?.decode()")
            assert page.evaluate(f"{events}[{i}].className") == "chosen"
            assert page.evaluate("document.querySelectorAll('tr.chosen').length") == 1
            if page.evaluate("!!document.querySelector('#frame img')"):
                assert page.evaluate("document.querySelector('#frame img').naturalWidth") == 480
                assert page.evaluate("document.querySelector('#frame img').alt") == page.evaluate(
                    f"'frame ' + {events}[{i}].dataset.frame"
                )
                shown.add(page.evaluate("document.querySelector('#frame img').src"))
            assert page.evaluate("model('chosen').data.x[0]") == pytest.approx(
                float(page.evaluate(f"{events}[{i}].dataset.at")), abs=1e-5
            )
        assert len(shown) >= 3
        page.evaluate("document.querySelectorAll('table')[1].tBodies[0].rows[9].click()")
        assert "empty.bag" in page.evaluate("document.querySelector('#frame').innerText")
        page.screenshot(path=tmp_path / "page.png")
        assert problems == []
    if "TTC_FAST_SCREENSHOTS" in os.environ:
        shutil.copy(tmp_path / "page.png", os.environ["TTC_FAST_SCREENSHOTS"])


@in_browser
def test_curves_of_one_log_zoom(tmp_path: Path) -> None:
    report = tmp_path / "report.html"
    assert main(["replay", str(sample("scans")), "--rows", "0", "--report", str(report)]) == 0
    with opened(report) as (page, problems):
        assert page.evaluate("[model('time').start, model('time').end]") == pytest.approx([0.0, 4.267], abs=1e-3)
        left, top, width, height = page.evaluate(
            """(() => { const find = root => { for (const each of root.querySelectorAll("*")) {
                 if (each.classList.contains("bk-events")) return each;
                 const inside = each.shadowRoot && find(each.shadowRoot); if (inside) return inside; } };
               const box = find(document).getBoundingClientRect();
               return [box.x, box.y, box.width, box.height]; })()"""
        )
        middle = top + min(height, 150.0) / 2
        page.mouse.move(left + 0.4 * width, middle)
        page.mouse.down()
        page.mouse.move(left + 0.6 * width, middle + 30, steps=2)
        page.mouse.up()
        page.evaluate("new Promise(done => setTimeout(done, 300))")
        start, end = page.evaluate("[model('time').start, model('time').end]")
        assert 0.5 < start < 2.2 < end < 3.8
        page.evaluate("document.querySelector('tbody tr').click()")  # the same log stays as it is
        assert page.evaluate("model('time').start") == start
        assert problems == []


def test_a_table_of_distances_since_1970_has_curves_and_no_picture(tmp_path: Path) -> None:
    table = tmp_path / "gaps.csv"
    table.write_text("stamp,distance\n" + "".join(f"{1.7e9 + i / 10},{20 - i / 2}\n" for i in range(30)))
    report = tmp_path / "report.html"
    assert main(["replay", str(table), "--report", str(report)]) == 0
    (data,) = data_of(report)
    stamps = np.frombuffer(base64.b64decode(data["rows"]["x"]), "<f4")
    np.testing.assert_allclose(stamps, np.arange(30) / 10, atol=1e-5)
    assert data["pictures"] == {}
    assert data["without"] == "A table of distances has no picture of a frame."


@in_browser
@pytest.mark.parametrize("count", [1, 2, 30])
def test_a_page_without_anything_known_has_an_empty_console(count: int, tmp_path: Path) -> None:
    table = tmp_path / "gaps.csv"
    table.write_text("stamp,distance\n" + "".join(f"{i / 10},nan\n" for i in range(count)))
    report = tmp_path / "report.html"
    main(["replay", str(table), "--report", str(report)])
    with opened(report) as (_, problems):
        assert problems == []


def test_a_report_that_makes_no_sense_or_cannot_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(sample("scans")), "--report", str(tmp_path / "report.pdf")]) == 2
    assert "--report must end in .html" in capsys.readouterr().err
    (tmp_path / "file").touch()
    assert main(["replay", str(sample("clouds")), "--report", str(tmp_path / "file" / "report.html")]) == 1
    assert "choose another --report" in capsys.readouterr().err


def test_what_an_earlier_run_did_is_in_the_report_without_its_frames(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    files = Files(report=tmp_path / "report.html")
    for _ in range(2):
        (result,) = replay_many([sample("clouds")], files=files, out=tmp_path / "out", jobs=1)
    assert result.skipped
    (data,) = data_of(tmp_path / "report.html")
    assert "An earlier run replayed this log" in data["without"]
    assert "EstimateThreshold" in (tmp_path / "report.html").read_text("utf-8")


def test_the_times_of_a_log_are_the_same_where_an_earlier_run_did_it(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    table, files = tmp_path / "since_1970.csv", Files(report=tmp_path / "report.html")
    table.write_text("stamp,distance\n" + "".join(f"{1.7e9 + i / 10:.1f},{30 - i / 2}\n" for i in range(50)))
    tables = []
    for skipped in (False, True):
        (result,) = replay_many([table], files=files, out=tmp_path / "out", jobs=1)
        assert result.skipped is skipped
        assert len(result.summary.events) > 0
        tables.append(re.findall("<tr data-log.*?</tr>", files.report.read_text("utf-8")))  # type: ignore[union-attr]
    replayed, left_out = tables
    assert replayed[0] == left_out[0]
    assert 'data-at="0.' not in replayed[0]
