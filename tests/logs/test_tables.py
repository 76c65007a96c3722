"""Tables of distances: columns that are called otherwise, and units that are not m and s."""

from pathlib import Path

import pytest

from tests.support.opened import read
from ttc_fast.logs import DistanceLog, LogError, open_log

METRES = [20.0 - 0.5 * i for i in range(30)]


def table(folder: Path, names: str, metre: float = 1.0, second: float = 1.0) -> Path:
    """Write a table that approaches at 5 m/s, 10 rows a second, in these units."""
    rows = [f"{0.1 * i / second!r},{gap / metre!r}" for i, gap in enumerate(METRES)]
    (folder / "gaps.csv").write_text("\n".join([names, *rows]) + "\n")
    return folder / "gaps.csv"


@pytest.mark.parametrize(
    ("stamp", "distance", "metre", "second", "units"),
    [
        ("stamp", "distance", 1.0, 1.0, ("m", "s")),
        ("time_ms", "distance_cm", 1e-2, 1e-3, ("cm", "ms")),
        ("Time (us)", "Gap [mm]", 1e-3, 1e-6, ("mm", "us")),
        ("timeMs", "distanceFeet", 0.3048, 1e-3, ("feet", "ms")),
        ("t s", "d.km", 1e3, 1.0, ("km", "s")),
        ("stamp_min", "range_max", 1.0, 1.0, ("m", "s")),
        ("atoms", "team", 1.0, 1.0, ("m", "s")),
    ],
)
def test_a_name_says_the_unit(
    stamp: str, distance: str, metre: float, second: float, units: tuple[str, str], tmp_path: Path
) -> None:
    log = open_log(table(tmp_path, f"{stamp},{distance}", metre, second), column=distance, stamp_column=stamp)
    assert isinstance(log, DistanceLog)
    assert (log.unit, log.clock, log.assumed) == (units[0], f"column {stamp}, in {units[1]}", "")
    frames = list(log)
    assert [frame.distance for frame in frames] == pytest.approx(METRES)
    assert [frame.stamp for frame in frames] == pytest.approx([0.1 * i for i in range(30)])


@pytest.mark.parametrize(
    ("name", "second", "start"),
    [
        ("time_us", 1e-6, 1200.0),  # 10 digits, as of s since 1970
        ("time_ns", 1e-9, 3.0),  # 10 digits
        ("time_ns", 1e-9, 2000.0),  # 13 digits
        ("time [ms]", 1e-3, 20 * 86400.0),  # 10 digits
        ("time_us", 1e-6, 1.7e9),
    ],
)
def test_a_unit_in_a_name_holds_however_many_digits_there_are(
    name: str, second: float, start: float, tmp_path: Path
) -> None:
    rows = [f"{round((start + 0.05 * i) / second)},{60.0 - i}" for i in range(60)]
    (tmp_path / "gaps.csv").write_text("\n".join([f"{name},distance", *rows]))
    log = open_log(tmp_path / "gaps.csv", stamp_column=name)
    assert log.assumed == ""
    assert [frame.stamp for frame in log] == pytest.approx([start + 0.05 * i for i in range(60)], abs=1e-6)


@pytest.mark.parametrize(
    ("name", "second", "start", "advice"),
    [
        ("stamp", 1e-3, 0.0, "stamp_ms"),
        ("stamp", 1e-6, 1200.0, "stamp_us"),
        ("stamp", 1e-9, 2.0, "stamp_ns"),
        ("stamp", 1e-9, 2000.0, "stamp_ns"),
        ("time_s", 1e-3, 1.7e9, "time_ms"),
        ("time_ms", 1.0, 1.7e9, "time_s"),
        ("t (ms)", 1e-6, 5.0, "t_us"),
    ],
)
def test_the_advice_on_a_unit_works(name: str, second: float, start: float, advice: str, tmp_path: Path) -> None:
    numbers = [(start + 0.1 * i) / second for i in range(60)]
    rows = [f"{number:.{1 if second == 1.0 else 0}f},{60.0 - i}" for i, number in enumerate(numbers)]
    (tmp_path / "gaps.csv").write_text("\n".join([f"{name},distance", *rows]))
    assumed = open_log(tmp_path / "gaps.csv", stamp_column=name).assumed
    assert assumed.endswith(f"name the column {advice}")
    (tmp_path / "gaps.csv").write_text("\n".join([f"{advice},distance", *rows]))
    log = open_log(tmp_path / "gaps.csv", stamp_column=advice)
    assert log.assumed == ""
    assert len(list(log)) == 60


def test_columns_that_are_called_otherwise_are_suggested(tmp_path: Path) -> None:
    said = (
        "has no column 'distance' and 'stamp'; its first line has time_ms, distance_cm: choose with the option "
        "column='distance_cm' and the option stamp_column='time_ms', or say the rate with the option rate"
    )
    with pytest.raises(LogError) as caught:
        open_log(table(tmp_path, "time_ms,distance_cm"))
    assert str(caught.value).endswith(said)
    with pytest.raises(LogError, match=r"has no column 'distance'; its first line has stamp, x: .* the option column$"):
        open_log(table(tmp_path, "stamp,x"))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "is empty"),
        ("\n \n", "must have the names of its columns in its first line, such as stamp,distance; it has nothing there"),
        ("0.0,20.0\n0.1,19.5\n", "must have the names of its columns .*; it has numbers, 0.0, 20.0 there"),
    ],
)
def test_a_table_without_names_says_what_it_needs(content: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "gaps.csv").write_text(content)
    with pytest.raises(LogError, match=said):
        open_log(tmp_path / "gaps.csv")


def test_numbers_that_are_hardly_in_metres_and_seconds_are_said(tmp_path: Path) -> None:
    assumed = open_log(table(tmp_path, "stamp,distance", 1e-2, 1e-3)).assumed
    assert "the stamps of column stamp are 100 s apart, read as they are; if they are in ms, name the column" in assumed
    assert "the distances of column distance have a median of 1275 m, read as they are; if they are in mm" in assumed


@pytest.mark.parametrize("word", ["1e999", "-1e999", "9" * 400])
def test_a_number_that_is_too_large_is_not_inf(word: str, tmp_path: Path) -> None:
    (tmp_path / "gaps.csv").write_text(f"stamp,distance\n0,9.0\n1,{word}\n2,inf\n")
    frames, said = read(tmp_path / "gaps.csv")
    assert [frame.distance for frame in frames] == [9.0, float("inf")]
    assert "line 3: it has a word that is no number" in said


@pytest.mark.parametrize("word", ["1e39", "1e999", "9" * 40])
def test_a_reading_that_is_too_large_is_not_inf(word: str, tmp_path: Path) -> None:
    lines = [f"FLASER 3 1.0 {each} 3.0 0 0 0 0 0 0 {stamp} host {stamp}" for stamp, each in enumerate(["2.0", word])]
    (tmp_path / "a.log").write_text("\n".join(lines))
    with pytest.raises(LogError, match="line 2 is damaged: FLASER with a word that is no number"):
        list(open_log(tmp_path / "a.log"))
