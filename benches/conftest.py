from __future__ import annotations

from typing import Any

from benches import machine


def pytest_benchmark_update_machine_info(machine_info: dict[str, Any]) -> None:
    """Saved results say what they were measured on, not where."""
    machine_info.pop("node", None)
    machine_info.update(machine.describe())
