"""The second step of a decision: what a frame comes to, by every criterion, and how it votes. Nothing is remembered."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ttc_fast.brake.decision import Command
from ttc_fast.brake.frame import CLOCK_TOLERANCE
from ttc_fast.brake.frozen import hold, hold_estimate
from ttc_fast.brake.state import Found
from ttc_fast.brake.types import Motion
from ttc_fast.status import Status

if TYPE_CHECKING:
    from ttc_fast.brake.frame import Frame
    from ttc_fast.brake.settings import BrakeSettings
    from ttc_fast.brake.state import Brake, ControllerState, Held
    from ttc_fast.brake.threats import ThreatAssessment
    from ttc_fast.brake.types import Criterion, Evaluation, Threats
    from ttc_fast.brake.unseen import FieldsOfView

NO_DATA, CONTACT = Status.NO_DATA, Status.CONTACT  # a name is looked up faster than the member of an enumeration


Vote = tuple[Found, bool, bool, "Motion | None", tuple[int, ...]]
"""How a frame votes: what it came to; whether it triggers, and whether it is clear; the motion that it was evaluated
for; the edges of the outline that the cloud turned out to look at.
"""

Assessed = tuple[Status, "Threats | None", "Held | None", Vote | None, Vote | None]
"""What the assessment of a frame came to: status and threats as ``Decision`` has them; the readings, to compare the
next ones with, None where the frame is ignored; the vote, None where it cannot be evaluated; and the vote without the
estimate, None where no estimate has ever come.
"""


class Evaluator:
    """The criteria of a controller, and what else makes the votes of a frame.

    Parameters
    ----------
    criteria : tuple of criteria
        The criteria.
    assessment : ThreatAssessment
        It finds the threats.
    fields_of_view : FieldsOfView
        It says which part of the path is seen.
    settings : BrakeSettings
        The settings of the controller.
    """

    def __init__(
        self,
        criteria: tuple[Criterion, ...],
        assessment: ThreatAssessment,
        fields_of_view: FieldsOfView,
        settings: BrakeSettings,
    ) -> None:
        self.criteria = criteria
        self._first, *self._others = criteria
        self._assessment, self._fields_of_view, self._settings = assessment, fields_of_view, settings
        self._stops_unseen = settings.when_blind == Command.BRAKE
        self._only_estimates = assessment.only_estimates
        self._hold = hold_estimate if assessment.only_estimates else hold
        self._release_at, self._min_returns = settings.release_at, settings.min_returns

    def assess(self, frame: Frame, state: ControllerState) -> Assessed:
        """Assess the threats of a frame, and evaluate them by every criterion."""
        if not frame.source.newest_at < frame.stamp <= frame.now + CLOCK_TOLERANCE:
            return Status.INVALID, None, None, None, None
        assessment, motion = self._assessment, frame.motion
        if self._only_estimates:
            threats = assessment.assess_estimate(frame)
        elif motion is None:
            threats = assessment.assess_without_odometry(frame)
        else:
            threats = assessment.assess_along(frame, motion, frame.path)
            if frame.path is not None:
                threats = assessment.assess_straying(frame, motion, threats)
        held = self._hold(frame, assessment, self._settings)
        status, vote, without = threats.status, None, None
        if status is NO_DATA or (self._min_returns and threats.returns < self._min_returns):
            status = NO_DATA
        elif not threats.closing_speed_known:
            status = Status.WARMING_UP
        elif held[-1]:
            status = Status.STALE
        else:
            unseen = self._fields_of_view.unseen(frame, motion)
            if frame.is_cloud and self._fields_of_view.others:  # one may have to know where the driver would go
                self._fields_of_view.unseen(frame, frame.commanded, alone=True)
            vote = self._evaluate(frame, threats, state, state.brake, unseen)
            other = state.brake_without_estimates
            if other is not None or (frame.estimate is not None and not self._only_estimates):
                alone = threats
                if frame.estimate is not None:
                    alone, frame.estimate = threats._replace(estimate=None, estimate_is_sure=False), None
                without = self._evaluate(frame, alone, state, other or state.brake, unseen)
        if assessment.range_rate is not None:
            assessment.take_up(frame)
        return status, threats if vote is not None else None, held, vote, without

    def _evaluate(
        self,
        frame: Frame,
        threats: Threats,
        state: ControllerState,
        brake: Brake,
        unseen: bool,
    ) -> Vote:
        """Evaluate threats by every criterion, and return how the frame votes on a brake."""
        motion, commanded = frame.motion, frame.commanded
        criterion, evaluation, value, threshold = self._most_urgent(threats)
        rests_in_contact = False
        if threats.status is CONTACT and not self._only_estimates:
            rests_in_contact = not (moves(motion) or moves(commanded))
            if commanded is not None and not brake.on:  # the vehicle must not be driven deeper into contact
                along = self._assessment.assess_along(frame, commanded, frame.path)
                of_commanded = self._most_urgent(along)
                if of_commanded[1].more_urgent_than(evaluation):
                    (criterion, evaluation, value, threshold), motion = of_commanded, commanded
        triggers, clear = value < threshold, value >= self._release_at * threshold
        if unseen and self._stops_unseen:
            triggers, clear = True, False
        if clear and self._only_estimates:  # what would be estimated if it went on is not known
            clear = frame.estimate is not None and frame.estimate.is_current(frame.now, self._settings.sensor_timeout)
        elif clear and brake.on:
            continued = commanded if commanded is not None else self._continued_motion(motion, brake)
            if continued is not None:
                clear, continues_unseen = self._would_be_clear(frame, continued)
                unseen = unseen or continues_unseen
        found = criterion, evaluation, rests_in_contact, unseen
        return found, triggers, clear, motion or state.newest[0], frame.looks

    def _most_urgent(self, threats: Threats) -> tuple[Criterion, Evaluation, float, float]:
        """Return the criterion nearest to its threshold, or beyond it by most, its evaluation, value and threshold."""
        urgent = self._first
        evaluation = urgent.evaluate(threats)
        value, threshold, _ = evaluation
        for criterion in self._others:
            other = criterion.evaluate(threats)
            its_value, its_threshold, _ = other
            if its_value * threshold < value * its_threshold:
                urgent, evaluation, value, threshold = criterion, other, its_value, its_threshold
        return urgent, evaluation, value, threshold

    def _would_be_clear(self, frame: Frame, continued: Motion) -> tuple[bool, bool]:
        """Return whether a frame is clear for what a braked vehicle would go on with, and whether its path is unseen.

        Being slow is not being safe: the vehicle sees nothing come closer because it is braked.
        """
        along = self._assessment.assess_along(frame, continued, frame.path)
        _, _, value, threshold = self._most_urgent(along)
        if value < self._release_at * threshold:
            return False, False
        unseen = self._fields_of_view.unseen(frame, continued)
        return not (unseen and self._stops_unseen), unseen

    def _continued_motion(self, motion: Motion | None, brake: Brake) -> Motion | None:
        """Return the motion of a vehicle that is released and not commanded, or None where that is not known."""
        before = brake.braked_from
        if motion is None:
            return before if moves(before) else None  # without odometry it may stand
        if motion.speed == 0.0 or abs(motion.speed) < self._settings.standstill_speed:
            return before
        faster = max(abs(before.speed / motion.speed), 1.0)  # the way it is on, at the speed it braked from
        return Motion(motion.speed * faster, motion.yaw_rate * faster, motion.lateral_speed * faster)


def moves(motion: Motion | None) -> bool:
    """Return whether a motion moves or turns the vehicle."""
    return motion is not None and any(motion[:3])
