"""What holds whatever comes to a brake controller, over random lives of controllers; docs/braking.md lists it.

A few lives are run with the other tests, and as many as one likes by
``TTC_FAST_LIVES=100000 pytest tests/brake/test_invariants.py -k lives``.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis.stateful import run_state_machine_as_test

from tests.support.brake_machine import BrakeMachine
from ttc_fast import Estimate
from ttc_fast.brake.decide import watchdog
from ttc_fast.brake.evaluate import Evaluator
from ttc_fast.brake.state import Brake, ControllerState
from ttc_fast.brake.unseen import FieldsOfView

if TYPE_CHECKING:
    from collections.abc import Callable

LIVES = int(os.environ.get("TTC_FAST_LIVES", "60"))
UNHURRIED: dict[str, Any] = {
    "deadline": None,
    "database": None,
    "suppress_health_check": list(HealthCheck),
    "phases": [Phase.generate],
    "report_multiple_bugs": False,
}


@pytest.mark.fuzz
def test_lives(record_property: Callable[[str, object], None]) -> None:
    record_property("inputs", LIVES)
    chosen = settings(max_examples=LIVES, stateful_step_count=20, derandomize=LIVES < 1000, **UNHURRIED)
    run_state_machine_as_test(BrakeMachine, settings=chosen)


def let_go_by_older_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    """Votes of older frames release in a frame that is not clear."""
    vote = Brake.vote

    def careless(self: Brake, now: float, triggers: bool, clear: bool, *arguments: Any) -> bool:
        older = self.on and self.release_votes > 0
        return vote(self, now, triggers and not older, clear or older, *arguments)

    monkeypatch.setattr(Brake, "vote", careless)


def trust_a_clock_set_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """The watchdog does not notice that frames are of the future."""
    monkeypatch.setattr(
        "ttc_fast.brake.controller.watchdog",
        lambda state, chosen, now: watchdog(state, chosen, max(now, state.scans.newest_at, state.clouds.newest_at)),
    )


def forget_a_vote(monkeypatch: pytest.MonkeyPatch) -> None:
    """A saved state has no votes on release."""
    saved = ControllerState.saved

    def forgetful(self: ControllerState) -> dict[str, Any]:
        state = saved(self)
        return {**state, "brake": {**state["brake"], "release_votes": 0}}

    monkeypatch.setattr(ControllerState, "saved", forgetful)


def look_everywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """The path is taken to be seen, wherever it leads."""
    monkeypatch.setattr(FieldsOfView, "unseen", lambda *_: False)


def believe_every_estimate(monkeypatch: pytest.MonkeyPatch) -> None:
    """An estimate that is lost, stale or old says that nothing is in the way."""
    monkeypatch.setattr(Estimate, "is_current", lambda *_: True)


def stop_when_standing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A braked vehicle that stands is taken to stay there."""
    monkeypatch.setattr(Evaluator, "_would_be_clear", lambda *_: (True, False))


MUTATIONS = [
    let_go_by_older_frames,
    trust_a_clock_set_back,
    forget_a_vote,
    look_everywhere,
    believe_every_estimate,
    stop_when_standing,
]


@pytest.mark.slow
@pytest.mark.parametrize("mutate", MUTATIONS, ids=lambda each: each.__name__)
def test_a_controller_that_is_wrong_is_found_out(
    mutate: Callable[[pytest.MonkeyPatch], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    mutate(monkeypatch)
    # Found after 500 lives on average. Which lives come depends on the modules that are loaded, derandomized or not.
    chosen = settings(max_examples=20_000, stateful_step_count=20, derandomize=True, **UNHURRIED)
    with pytest.raises(AssertionError):
        run_state_machine_as_test(BrakeMachine, settings=chosen)
