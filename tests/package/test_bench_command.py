"""``ttc-fast bench``: it compares before it times."""

from typing import Any

import pytest

from ttc_fast import bench, reference
from ttc_fast.cli import main


def test_bench_compares_and_prints(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "--beams", "64", "--points", "999", "--rounds", "3"]) == 0
    output = capsys.readouterr().out
    for call in (*(f"ScanTTC.{method} " for method in bench.METHODS), "robust_min_x "):
        assert call in output
    assert "the answers were compared and agree" in output


def test_bench_refuses_to_time_wrong_answers(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Wrong(reference.ScanTTC):
        def min(self, *arguments: Any, **keywords: Any) -> Any:
            return 1.01 * super().min(*arguments, **keywords)

    def wrong(points: Any, **settings: Any) -> Any:
        return right(points - 0.5, **settings)

    right = reference.robust_min_x
    monkeypatch.setattr(reference, "ScanTTC", Wrong)
    monkeypatch.setattr(reference, "robust_min_x", wrong)
    assert main(["bench", "--beams", "64", "--points", "20000", "--rounds", "3"]) == 1
    said = capsys.readouterr().err
    assert "ttc-fast: ScanTTC.min, robust_min_x and the reference give different answers" in said
