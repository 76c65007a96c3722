"""The second step of a decision: what a frame comes to, by every criterion, and how it votes. Nothing is remembered."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from ttc_fast.brake.decision import Command
from ttc_fast.brake.frozen import NEVER, hold, hold_estimate
from ttc_fast.brake.receive import CLOCK_TOLERANCE
from ttc_fast.brake.types import NOTHING, Motion, new
from ttc_fast.status import Status

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ttc_fast.brake.frozen import Held
    from ttc_fast.brake.receive import Frame
    from ttc_fast.brake.settings import BrakeSettings
    from ttc_fast.brake.state import Brake, ControllerState
    from ttc_fast.brake.threats import ThreatAssessment
    from ttc_fast.brake.types import Criterion, Evaluation, Threats
    from ttc_fast.brake.unseen import FieldsOfView, Seeing

NO_DATA, CONTACT = Status.NO_DATA, Status.CONTACT  # a name is looked up faster than the member of an enumeration


class Assessed(NamedTuple):
    """What the assessment of a frame came to.

    Attributes
    ----------
    status, threats
        Status and threats as ``Decision`` has them.
    held : Held
        The readings, to compare the next ones with.
    criterion : Criterion or None
        The most urgent criterion; None where the frame cannot be evaluated.
    evaluation : Evaluation
        The evaluation by that criterion.
    triggers, clear : bool
        The votes of the frame on braking and on release.
    motion : Motion or None
        The motion that it was evaluated for.
    rests_in_contact : bool
        Whether something is inside the outline, and neither motion nor command says which way it will go.
    unseen : bool
        Whether nothing looks at a part of the path, or of the path that a braked vehicle would go on with.
    looks : tuple of int
        The edges of the outline that the cloud turned out to look at.
    without_estimates : Assessed or None
        What it would have come to without the estimate; None where no estimate has ever come.
    """

    status: Status | None
    threats: Threats | None = None
    held: Held = NEVER
    criterion: Criterion | None = None
    evaluation: Evaluation = NOTHING
    triggers: bool = False
    clear: bool = False
    motion: Motion | None = None
    rests_in_contact: bool = False
    unseen: bool = False
    looks: tuple[int, ...] = ()
    without_estimates: Assessed | None = None


BETWEEN_FRAMES, IGNORED = Assessed(None), Assessed(Status.INVALID)


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
        self._release_at = settings.release_at

    def assess(self, frame: Frame, state: ControllerState, others: Sequence[Seeing]) -> Assessed:
        """Assess the threats of a frame, and evaluate them by every criterion."""
        source = state.scans if frame.points is None else state.clouds
        if not source.newest_at < frame.stamp <= frame.now + CLOCK_TOLERANCE:
            return IGNORED
        assessment, settings = self._assessment, self._settings
        threats = assessment.assess(frame)
        if not self._only_estimates:
            held = hold(source, frame, assessment, settings)
        elif frame.estimate is None or frame.estimate.saw_nothing:
            held = source.held
        else:
            held = hold_estimate(source, frame.estimate, settings)
        if threats.status is NO_DATA or threats.returns < settings.min_returns:
            assessed = Assessed(NO_DATA, None, held)
        elif not threats.closing_speed_known:
            assessed = Assessed(Status.WARMING_UP, None, held)
        elif held.is_frozen:
            assessed = Assessed(Status.STALE, None, held)
        else:
            unseen, edge = self._fields_of_view.unseen(frame, state, frame.motion, others)
            looks = () if edge is None else (edge,)
            if others and frame.points is not None:  # another controller may have to know where the driver would go
                _, edge = self._fields_of_view.unseen(frame, state, frame.commanded)
                looks = looks if edge is None else (*looks, edge)
            assessed = self._evaluate(frame, threats, state, state.brake, unseen, held, looks, others)
            without = state.brake_without_estimates
            if without is not None or (frame.estimate is not None and not self._only_estimates):
                if frame.estimate is not None:
                    threats = threats._replace(estimate=None, estimate_is_sure=False)
                    frame = replace(frame, estimate=None)
                other = self._evaluate(frame, threats, state, without or state.brake, unseen, held, looks, others)
                assessed = assessed._replace(without_estimates=other)
        if assessment.range_rate is not None:
            assessment.take_up(frame)
        return assessed

    def _evaluate(
        self,
        frame: Frame,
        threats: Threats,
        state: ControllerState,
        brake: Brake,
        unseen: bool,
        held: Held,
        looks: tuple[int, ...],
        others: Sequence[Seeing],
    ) -> Assessed:
        """Evaluate threats by every criterion, and return how the frame votes on a brake."""
        motion, commanded = frame.motion, frame.commanded
        criterion, evaluation = self._most_urgent(threats)
        status = threats.status
        rests_in_contact = False
        if status is CONTACT and not self._only_estimates:
            rests_in_contact = not (moves(motion) or moves(commanded))
            if commanded is not None and not brake.on:  # the vehicle must not be driven deeper into contact
                other, of_commanded = self._most_urgent(self._assessment.assess_along(frame, commanded))
                if of_commanded.more_urgent_than(evaluation):
                    criterion, evaluation, motion = other, of_commanded, commanded
        value, threshold, _ = evaluation
        stops = unseen and self._stops_unseen
        triggers, clear = value < threshold or stops, value >= self._release_at * threshold and not stops
        if clear and self._only_estimates:  # what would be estimated if it went on is not known
            clear = frame.estimate is not None and frame.estimate.is_current(frame.now, self._settings.sensor_timeout)
        elif clear and brake.on:
            continued = commanded if commanded is not None else self._continued_motion(motion, brake)
            if continued is not None:
                clear, continues_unseen, edge = self._would_be_clear(frame, continued, state, others)
                unseen, looks = unseen or continues_unseen, looks if edge is None else (*looks, edge)
        motion = motion or state.motion
        return new(
            Assessed,
            (
                status,
                threats,
                held,
                criterion,
                evaluation,
                triggers,
                clear,
                motion,
                rests_in_contact,
                unseen,
                looks,
                None,
            ),
        )

    def _most_urgent(self, threats: Threats) -> tuple[Criterion, Evaluation]:
        """Return the criterion that is nearest to its threshold, or beyond it by most, and its evaluation."""
        urgent, evaluation = self._first, self._first.evaluate(threats)
        for criterion in self._others:
            other = criterion.evaluate(threats)
            if other.value * evaluation.threshold < evaluation.value * other.threshold:
                urgent, evaluation = criterion, other
        return urgent, evaluation

    def _would_be_clear(
        self, frame: Frame, continued: Motion, state: ControllerState, others: Sequence[Seeing]
    ) -> tuple[bool, bool, int | None]:
        """Return whether a frame is clear for what a braked vehicle would go on with, and what is seen of its path.

        Being slow is not being safe: the vehicle sees nothing come closer because it is braked.
        """
        _, (value, threshold, _) = self._most_urgent(self._assessment.assess_along(frame, continued))
        if value < self._release_at * threshold:
            return False, False, None
        unseen, edge = self._fields_of_view.unseen(frame, state, continued, others)
        return not (unseen and self._stops_unseen), unseen, edge

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
