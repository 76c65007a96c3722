from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benches import machine

if TYPE_CHECKING:
    import pytest


def pytest_configure(config: pytest.Config) -> None:
    """Refuse to time what is no release build."""
    if not config.getoption("benchmark_disable", False):
        machine.require_release()


def pytest_benchmark_update_machine_info(machine_info: dict[str, Any]) -> None:
    """Saved results say what they were measured on, not where."""
    machine_info.pop("node", None)
    machine_info.update(machine.describe())
