"""Random lives of brake controllers: frames, odometry, estimates, gaps, clocks set back, commands, overrides, restores.

``BrakeMachine`` is a state machine of Hypothesis. It drives three controllers with the same inputs: ``plain`` never
gets an estimate, ``informed`` does, and ``twin`` gets what ``informed`` gets and is saved and restored at any time.
What must hold is checked after each update, against a model that knows what it has fed in.
"""

from __future__ import annotations

import copy
import math
import pickle
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule

from ttc_fast import BrakeController, Command, Estimate, Motion, RangeRate, Reason, ScanTTC, Status, SweptPath

if TYPE_CHECKING:
    from ttc_fast.brake import Decision

CAR = (-0.1, 0.4, -0.15, 0.15)
BEAMS = 48
FRONT: dict[str, Any] = {"angle_min": -2.35, "angle_increment": 0.1, "beams": BEAMS, "mount": (0.25, 0.0, 0.0)}
SCENES = ("free", "free", "far", "near", "near", "blind")
"""What a frame shows: nothing, a wall 6 m or 0.3 m before the bumper, or nothing valid."""
SPEEDS = st.sampled_from([0.0, 0.0, 0.02, 0.5, 2.0, 4.0, 4.0, -0.5, -2.0])
MOTIONS = st.tuples(SPEEDS, st.sampled_from([0.0, 0.0, 0.5, -1.0])).map(lambda pair: Motion(*pair))
ESTIMATES = st.fixed_dictionaries(
    {
        "ttc": st.sampled_from([0.3, 1.0, 2.0, 30.0, math.inf]),
        "distance": st.sampled_from([math.nan, -0.1, 0.3, 5.0, 40.0]),
        "closing_speed": st.sampled_from([math.nan, -1.0, 0.0, 0.5, 3.0]),
        "status": st.sampled_from([None, *Status]),
        "age": st.sampled_from([0.0, 0.0, 0.1, 0.6]),
    }
)
STEPS = st.sampled_from([0.005, 0.025, 0.025, 0.025, 0.1, 0.2])


def scan_of(scene: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the ranges of a scene."""
    angles = FRONT["angle_min"] + FRONT["angle_increment"] * np.arange(BEAMS)
    wall = {"free": 20.0, "far": 6.15, "near": 0.45, "blind": math.nan}[scene]
    return np.where(np.abs(angles) < 0.5, wall / np.cos(angles), math.nan if scene == "blind" else 20.0)


def cloud_of(scene: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the points of a scene, all around but straight behind."""
    bearing = np.arange(-3.0, 3.0, 0.05)
    wall = {"free": 20.0, "far": 6.4, "near": 0.7, "blind": math.nan}[scene]
    distance = np.where(np.abs(bearing) < 0.5, wall / np.cos(bearing), math.nan if scene == "blind" else 20.0)
    return np.column_stack([distance * np.cos(bearing), distance * np.sin(bearing)])


class Same(NamedTuple):
    """The newest readings of a sensor.

    Attributes
    ----------
    readings : str or bytes
        The readings.
    since, last : float
        When they came first and last, s.
    motion : Motion or None
        The motion known when they came last.
    way : float
        How far the vehicle has driven since they came first, m; NaN where it did not go straight one way.
    """

    readings: str | bytes
    since: float
    last: float
    motion: Motion | None
    way: float


class BrakeMachine(RuleBasedStateMachine):
    """Three controllers, and what is known of what they were given."""

    def __init__(self) -> None:
        super().__init__()
        self.now = 100.0
        self.motion_at = -math.inf
        self.newest: dict[str, float] = {}
        self.evaluated_at: dict[str, float] = {}
        """Stamps of the newest frame of each sensor, and of the newest that was evaluated."""
        self.motion: Motion | None = None
        self.unseen = False
        self.count = 0
        self.was_fast: set[str] = set()
        """The controllers that brake, and have seen the near wall at 4 m/s since they began."""
        self.same: dict[str, Same] = {}
        """The newest readings of each sensor."""

    @initialize(
        kind=st.sampled_from(["scan", "scan", "cloud", "both", "rated", "estimates", "estimates"]),
        when_blind=st.sampled_from([Command.BRAKE, Command.BRAKE, Command.WARN]),
        votes=st.sampled_from([{}, {}, {"trigger": (1, 1), "release": (1, 1)}, {"trigger": (2, 3), "release": (2, 4)}]),
        hold=st.sampled_from([0.0, 0.0, 0.5]),
    )
    def begin(self, kind: str, when_blind: Command, votes: dict[str, Any], hold: float) -> None:
        """Make the controllers."""
        scan = ScanTTC(**FRONT, range_max=30.0, outline=CAR)
        self.kind = kind
        self.settings: dict[str, Any] = {"when_blind": when_blind, "hold": hold, **votes}
        if kind not in ("cloud", "estimates"):
            self.settings["scan"] = scan
        if kind in ("cloud", "both"):
            self.settings["path"] = SweptPath(CAR)
        self.plain, self.informed, self.twin = self.made(), self.made(), self.made()
        self.timeout = self.plain.settings.sensor_timeout

    def made(self) -> BrakeController:
        """Return a new controller."""
        rate = RangeRate(self.settings["scan"]) if self.kind == "rated" else None
        return BrakeController(range_rate=rate, **self.settings)

    @rule(
        wait=STEPS,
        late=st.sampled_from([0.0, 0.0, 0.02, 0.25, -0.05, -0.2]),
        scene=st.sampled_from(SCENES),
        as_cloud=st.booleans(),
        motion=st.none() | MOTIONS,
        estimate=st.none() | ESTIMATES,
        commanded=st.none() | SPEEDS,
        override=st.sampled_from([False, False, False, True]),
        count=st.sampled_from([1, 1, 3, 6]),
        freezes=st.sampled_from([False, False, True]),
    )
    def frames(
        self, wait: float, late: float, scene: str, as_cloud: bool, count: int, freezes: bool, **more: Any
    ) -> None:
        """Give frames of one scene, one after the other; those of a sensor that freezes are the same to the bit."""
        for _ in range(count):
            self.now += wait
            stamp = self.now - late
            data: dict[str, Any] = {"stamp": stamp}
            self.count += not freezes
            if self.kind == "estimates":
                data = {}
            elif self.kind == "cloud" or (self.kind == "both" and as_cloud):
                data["points"] = cloud_of(scene) + 1e-7 * self.count
            else:
                data["ranges"] = scan_of(scene) + 1e-7 * self.count
            self.update(scene, stamp, data, **more)

    @rule(wait=st.sampled_from([0.0, 0.05, 0.2, 0.6, 5.0]), override=st.booleans())
    def wait(self, wait: float, override: bool) -> None:
        """Let time pass; only the watchdog looks."""
        self.now += wait
        self.update(None, math.nan, {}, None, None, None, override)

    @rule(back=st.sampled_from([0.05, 0.3, 2.0]))
    def set_clock_back(self, back: float) -> None:
        """Set the clock back."""
        self.now -= back

    @rule(how=st.sampled_from(["restore", "pickle", "copy", "refused", "itself"]))
    def save(self, how: str) -> None:
        """Save the twin and go on from that, or have it refuse a call."""
        if how == "restore":
            state, self.twin = self.twin.state(), self.made()
            self.twin.restore(state)
        elif how == "pickle":
            self.twin = pickle.loads(pickle.dumps(self.twin))
        elif how == "copy":
            self.twin = copy.deepcopy(self.twin)
        elif how == "itself":
            self.twin.restore(self.twin.state())
        else:
            with pytest.raises(ValueError, match="finite"):
                self.twin.update(self.now + 0.01, motion=Motion(math.nan), estimate=Estimate(self.now, 0.1))

    def teardown(self) -> None:
        """Compare what twins remember in the end."""
        if hasattr(self, "twin"):
            assert repr(self.twin.state()) == repr(self.informed.state())

    def update(
        self,
        scene: str | None,
        stamp: float,
        data: dict[str, Any],
        motion: Motion | None,
        estimate: dict[str, Any] | None,
        commanded: float | None,
        override: bool,
    ) -> None:
        """Give all controllers an update, and check what must hold."""
        more: dict[str, Any] = {"motion": motion, "commanded": commanded, "override": override}
        known: dict[str, Any] = (
            {} if estimate is None else {"estimate": Estimate(self.now if scene is None else stamp, **estimate)}
        )
        were_on = on(self.plain), on(self.informed)
        plain = self.plain.update(self.now, **data, **more, **(known if self.kind == "estimates" else {}))
        informed = self.informed.update(self.now, **data, **more, **known)
        twin = self.twin.update(self.now, **data, **more, **known)
        assert repr(twin) == repr(informed), "the same inputs, and saving at any time, give the same bits"
        assert informed.command >= plain.command, "an estimate brakes less than none"
        self.learn(scene, stamp, motion, plain, estimate, data)
        for name, decision, was_on in zip(("plain", "informed"), (plain, informed), were_on, strict=True):
            if not override:
                self.check_darkness(decision)
            if on(getattr(self, name)):
                if scene == "near" and decision.threats is not None and decision.threats.speed == 4.0:
                    self.was_fast.add(name)
                continue
            if was_on:
                self.check_release(name, decision, scene, commanded, estimate)
            self.was_fast.discard(name)

    def learn(
        self,
        scene: str | None,
        stamp: float,
        motion: Motion | None,
        decision: Decision,
        estimate: dict[str, Any] | None,
        data: dict[str, Any],
    ) -> None:
        """Keep in mind what the controllers were given."""
        if motion is not None and self.motion_at <= self.now:
            self.motion, self.motion_at = motion, self.now
        sensor = next((name for name in ("ranges", "points") if name in data), "estimate")
        if scene is None or decision.status is None or not self.newest.get(sensor, -math.inf) < stamp <= self.now + 0.1:
            return
        self.newest[sensor] = stamp
        fresh, nothing = -0.1 <= self.now - self.motion_at <= 0.5, False
        if self.kind == "estimates":
            assert estimate is not None
            unknown = estimate["status"] in (Status.WARMING_UP, Status.STALE) and estimate["ttc"] == math.inf
            nothing = estimate["status"] in (Status.NO_DATA, Status.INVALID)
            evaluated = not nothing and (not unknown or estimate["distance"] <= 0.0)
        else:
            evaluated = scene != "blind" and (fresh or (self.kind == "rated" and decision.threats is not None))
        if estimate is None or not nothing:
            frozen = self.is_frozen(sensor, stamp, self.motion if fresh else None, data, estimate)
            is_stale = decision.status is Status.STALE and decision.threats is None
            assert is_stale or not (frozen and evaluated), "it believes a frozen sensor"
            if is_stale:
                evaluated = False
                self.evaluated_at[sensor] = min(self.same[sensor].since, self.evaluated_at.get(sensor, -math.inf))
        if evaluated:
            self.evaluated_at[sensor] = stamp
            back = fresh and self.motion is not None and self.motion.speed < -0.05
            self.unseen = back and self.kind in ("scan", "cloud", "rated")

    def is_frozen(
        self, sensor: str, stamp: float, motion: Motion | None, data: dict[str, Any], estimate: dict[str, Any] | None
    ) -> bool:
        """Return whether a sensor has surely sent the same for too long a time and way, straight one way."""
        readings = repr(estimate) if sensor == "estimate" else data[sensor].tobytes()
        same = self.same.get(sensor)
        if same is None or readings != same.readings:
            self.same[sensor] = Same(readings, stamp, stamp, motion, 0.0)
            return False
        _, since, last, before, way = same
        if motion is not None and before is not None:
            speed = min(motion.speed, before.speed, key=abs)  # it may have started or stopped in between
            straight = not (motion.yaw_rate or before.yaw_rate) and way * speed >= 0.0
            if abs(speed) > 0.05:
                way = way + speed * (stamp - last) if straight else math.nan
        self.same[sensor] = Same(readings, since, stamp, motion, way)
        if sensor == "estimate":
            assert estimate is not None
            ttc, nearer = estimate["ttc"], estimate["distance"] * (stamp - since) / estimate["ttc"]
            changes = ttc < math.inf and not nearer < 0.26
        else:
            changes = abs(way) > 0.76
        return changes and stamp - since > self.timeout + 1e-6

    def check_darkness(self, decision: Decision) -> None:
        """Check that it does not go on where it does not see."""
        in_time = any(self.now - each <= self.timeout for each in self.evaluated_at.values())
        seen = in_time and max(self.newest.values()) <= self.now + 0.1
        if not seen or self.unseen:
            assert decision.command is not Command.NONE, "it goes on in the dark"

    def check_release(
        self,
        name: str,
        decision: Decision,
        scene: str | None,
        commanded: float | None,
        estimate: dict[str, Any] | None,
    ) -> None:
        """Check that the frame in which a brake was let go is a clear one."""
        assert scene is not None, "it let go without a frame"
        assert decision.threats is not None, "it let go in a frame that it does not believe"
        assert not decision.value < decision.threshold, "it let go in a frame that triggers"
        assert decision.reason is not Reason.UNSEEN or self.settings["when_blind"] is Command.WARN
        if estimate is not None and self.kind == "estimates":
            unsure = estimate["status"] in (Status.TOO_FEW, Status.WARMING_UP, Status.LOST, Status.STALE)
            assert not unsure, "an estimate that says nothing let go"
            assert estimate["age"] < self.timeout, "an old measurement let go"
        if scene == "near" and self.motion is not None and self.kind in ("scan", "cloud"):
            continued = commanded if commanded is not None else self.motion.speed
            if commanded is None and name in self.was_fast and decision.threats.speed == 0.0:
                continued = 4.0
            assert continued < 2.0, "it let go for what it would hit"


def on(controller: BrakeController) -> bool:
    """Return whether a controller brakes."""
    return any(each.on for each in controller._state.brakes)
