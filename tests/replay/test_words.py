"""What the command line says: options as they are typed, what a mistake may have meant, and nothing of Python."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.support.bags import Odom, Scan, write
from ttc_fast._settings import ON_COMMAND_LINE, settings_of
from ttc_fast.cli import main
from ttc_fast.logs import LogError, LogOptions, open_log
from ttc_fast.replay import Replay, Settings, sample

SCANS, CLOUDS = str(sample("scans")), str(sample("clouds"))
TABLE = "stamp,gap\n0.0,9.0\n0.1,8.9\n"


def said(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    """Run the command and return its exit code and standard error."""
    try:
        code = main(arguments)
    except SystemExit as end:
        code = int(str(end.code))
    return code, capsys.readouterr().err


def test_an_option_is_named_as_it_is_typed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "gaps.csv").write_text(TABLE)
    two = write(tmp_path, "bag", [Scan(i / 10, i / 10, topic=topic) for i in range(5) for topic in ("/a", "/b")])
    for path, option, python in (
        (tmp_path / "gaps.csv", "--column", "the option column"),
        (two, "--topic", "the option topic"),
    ):
        code, text = said(["replay", str(path)], capsys)
        assert code == 3
        assert f"with {option}" in text
        assert "the option" not in text
        with pytest.raises(LogError, match=f"with {python}"):
            open_log(path)
    with pytest.raises(LogError, match="no use for the option gate_x; leave it out"):
        Replay(SCANS, Settings(gate={"x": (0.0, 1.0)}))
    assert not ON_COMMAND_LINE.get()


def test_every_option_that_a_log_has_no_use_for_is_named_as_it_is_typed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "gaps.csv").write_text(TABLE)
    values = {"mount": ["1", "0", "0"], "outline": ["-1", "1", "-1", "1"], "axes": ["x,y,z"], "upside_down": []}
    values |= {"clock": ["header"]}
    for each in settings_of(LogOptions):
        flag = f"--{each.name.replace('_', '-')}"
        arguments = [flag, *values.get(each.name, ["1"])]
        for path in (str(tmp_path / "gaps.csv"), SCANS):
            code, text = said(["replay", path, *arguments, "--rows", "0"], capsys)
            assert code in (0, 3)
            if "_" in each.name:
                assert each.name not in text
            if "no use" in text:
                assert f"no use for {flag};" in text


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["--oultine", "0", "1"], 2, "there is no option --oultine: did you mean --outline?"),
        (["--colum=x"], 3, ""),  # an abbreviation
        (["--treshold=1"], 2, "there is no option --treshold: "),
        (["--criterion", "IttcTreshold"], 2, "got 'IttcTreshold': did you mean IttcThreshold?"),
        (["--criterion", "Ittc"], 2, "got 'Ittc': did you mean IttcThreshold?"),
        (["--criterion", "IttcThreshold:treshold=1"], 2, "no setting 'treshold': did you mean threshold?"),
        (["--range-min", "9", "--range-max", "3"], 2, "--range-max must be above range_min"),
        (["--front-offset", "-3"], 2, "--front-offset must be finite and at least 0 m, got -3.0"),
        (["--sensor-timeout", "-1"], 2, "--sensor-timeout must be finite and above 0 s"),
        (["--rate", "-1"], 2, "--rate must be finite and at least 0.001 Hz"),
        (["--outline", "1", "2", "3"], 2, "argument --outline: expected 4 arguments"),
    ],
)
def test_a_mistake_is_named(arguments: list[str], code: int, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    ended, text = said(["replay", SCANS, "--rows", "0", *arguments], capsys)
    assert ended == code
    assert words in text


def test_an_option_of_open_log_that_does_not_exist_is_named() -> None:
    with pytest.raises(TypeError, match=r"open_log has no option 'colum': did you mean column\?"):
        open_log(SCANS, colum="gap")


@pytest.mark.parametrize("low", ["-inf", "-1e3", "-.5", "-1.", "-1E+3", "-Infinity"])
def test_negative_numbers_are_no_options(low: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert said(["replay", CLOUDS, "--gate-z", low, "inf", "--rows", "0"], capsys) == (0, "")
    assert said(["replay", CLOUDS, f"--speed={low}", "--rows", "0"], capsys)[0] == (2 if "nf" in low else 0)


def test_the_package_is_a_command(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-m", "ttc_fast", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("ttc-fast ")


def test_a_table_of_criteria_that_should_be_a_list_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "car.toml").write_text('[criteria]\nkind = "IttcThreshold"\n')
    code, text = said(["replay", SCANS, "--config", str(tmp_path / "car.toml")], capsys)
    assert code == 2
    assert "write [[criteria]] instead of [criteria]" in text


def test_what_was_lost_is_said_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ranges = np.full(64, 4.0, np.float32)
    items = [each for i in range(60) for each in (Odom(i / 40, i / 40, speed=math.inf), Scan(i / 40, i / 40, ranges))]
    path = write(tmp_path, "bag", items)
    assert main(["replay", str(path), "--rows", "0"]) == 5
    told = capsys.readouterr()
    assert (told.out + told.err).count("is not finite") == 1
    assert "odometry at 0.000 s is not finite, and 59 more like it. The 60 frames" in told.err
    assert "lost        a part of the log; the message on standard error says which" in told.out


def test_odometry_that_is_refused_is_not_called_old_as_well(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It moves as its twist says for a second, and then the other way."""
    x, items = 0.0, list[Odom | Scan]()
    for i in range(160):
        x += 0.05 if i < 40 else -0.05
        items += [Odom(i / 40, i / 40, x=x, speed=2.0), Scan(i / 40, i / 40, np.full(64, 4.0, np.float32))]
    assert main(["replay", str(write(tmp_path, "bag", items)), "--rows", "0"]) == 0
    said = capsys.readouterr().out
    assert "/odom, twist" in said
    assert "/odom, clock" not in said


HURRIED = """
import os, signal, sys, time
from multiprocessing.context import SpawnProcess
from ttc_fast.cli import main

def catches_interrupts(process):  # Python has begun there
    status = open(f"/proc/{process.pid}/status").read()
    return int(status.partition("SigCgt:")[2].split()[0], 16) >> signal.SIGINT - 1 & 1

def start(process):
    begin(process)
    while not catches_interrupts(process):
        time.sleep(0.001)
    os.kill(process.pid, signal.SIGINT)
    time.sleep(0.5)
    os.kill(os.getpid(), signal.SIGINT)

begin, SpawnProcess.start = SpawnProcess.start, start
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="it sees in /proc that Python has begun")
def test_an_interrupt_while_processes_begin_is_one_line(tmp_path: Path) -> None:
    """A terminal interrupts the processes as well, which import what they need at that time."""
    replay = ["replay", *[SCANS] * 8, "--out", str(tmp_path / "rows.csv"), "--jobs", "2"]
    process = subprocess.Popen(
        [sys.executable, "-c", HURRIED, *replay],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    out, err = process.communicate(timeout=60)
    assert (process.returncode, err, out) == (130, "ttc-fast: interrupted\n", "")


@pytest.mark.parametrize(("typed", "words"), [("repaly", "did you mean replay?"), ("xyz", "there are replay, demo, ")])
def test_a_command_that_is_none(typed: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([typed])
    assert ended.value.code == 2
    assert f"there is no command {typed}: {words}" in capsys.readouterr().err
