"""What criteria are shown, what they say, and what a controller asks of them."""

from __future__ import annotations

import math
from enum import Enum
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Protocol

from ttc_fast.status import Status

if TYPE_CHECKING:
    from ttc_fast.brake.sight import Threat


class Threats(NamedTuple):
    """All that is seen at the time of a decision. What nobody looked for, or could see, is None.

    Attributes
    ----------
    speed : float or None
        Of the vehicle over ground, m/s, without sign; None without odometry.
    beams : Threat or None
        The nearest by iTTC.
    path : Threat or None
        The nearest on the way of the outline.
    estimate : Threat or None
        The estimate.
    sure : bool
        Whether the estimate is sure that something comes closer: its interval does not reach infinity. In
        contact, that it is not sure that it moves away: the interval of its closing speed reaches 0.
    returns : int
        Valid readings or points.
    status : Status
        Of the frame: NO_DATA when nothing valid was seen.
    judged : bool
        Whether something told the closing speeds.
    """

    speed: float | None
    beams: Threat | None
    path: Threat | None
    estimate: Threat | None
    sure: bool
    returns: int
    status: Status
    judged: bool

    @property
    def touches(self) -> bool:
        """Whether the estimate is in contact, and not sure that it moves away."""
        return self.sure and self.estimate is not None and self.estimate.status is Status.CONTACT


class Evaluation(NamedTuple):
    """What a criterion compares: it triggers when ``value < threshold``.

    Attributes
    ----------
    value, threshold : float
        In the criterion's unit.
    threat : Threat or None
        What it looked at.
    """

    value: float
    threshold: float
    threat: Threat | None

    @property
    def triggers(self) -> bool:
        """Whether it is time to brake."""
        return self.value < self.threshold

    def more_urgent_than(self, other: Evaluation) -> bool:
        """Whether it is nearer to its threshold than the other to its own, or beyond it by more."""
        return self.value * other.threshold < other.value * self.threshold


class Needs(Enum):
    """What a criterion has to be shown."""

    BEAMS = "beams"
    """The nearest by iTTC."""
    PATH = "path"
    """The nearest on the way of the outline."""
    NEAREST = "nearest"
    """What is on the way where there is an outline, else the nearest by iTTC."""
    ESTIMATE = "estimate"
    """The estimate alone."""


class Criterion(Protocol):
    """What a controller asks of a criterion. One's own may be anything that has these.

    Attributes
    ----------
    name, unit : str
        For people.
    needs : Needs
        What has to be computed for it.
    """

    name: ClassVar[str]
    unit: ClassVar[str]
    needs: ClassVar[Needs]

    def evaluate(self, threats: Threats) -> Evaluation:
        """Compare what is seen with the threshold.

        Parameters
        ----------
        threats : Threats
            What is seen.

        Returns
        -------
        Evaluation

        Examples
        --------
        >>> from ttc_fast import IttcThreshold, Status
        >>> from ttc_fast.brake import Threats, Threat, Source
        >>> threat = Threat(Source.BEAMS, 1.2, Status.CLOSING, 7, 0.0, 6.0, 6.0, 5.0, 0.0)
        >>> threats = Threats(5.0, threat, None, None, False, 100, Status.CLOSING, True)
        >>> IttcThreshold(1.5).evaluate(threats).triggers
        True
        """
        ...


NOTHING = Evaluation(math.inf, 0.0, None)
"""What there is to say where nothing is to be judged."""
