"""A simulated lidar behind a simulated car: ring by ring, with the flaws of a real one, and with the exact truth.

The scanner turns 64 rings; the rear ahead of it is made of curved panels, each of which a ray meets in closed form. So
the noise that is put in is all the noise there is, and what an estimate of the motion could reach at best is known.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ttc_fast import Gate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

ROAD_REFLECTIVITY = 0.15
RATE = 10.0
"""The turns of the scanner per second."""


@dataclass(frozen=True)
class Scanner:
    """A lidar with 64 rings, as on the cars of KITTI."""

    height: float = 1.73
    """The height of the scanner above the road, m."""
    rings: Floats = field(
        default_factory=lambda: np.radians(
            np.concatenate([np.linspace(2.0, -8.33, 32), np.linspace(-8.83, -24.33, 32)])
        )
    )
    """The elevation of each ring from the horizon, rad."""
    azimuths: Floats = field(default_factory=lambda: np.radians(np.arange(-20.0, 20.0, 0.18)))
    """The azimuths of a turn, positive to the left, rad."""
    range_noise: float = 0.02
    """The standard deviation of a range, m."""
    dropouts: float = 0.03
    """The share of returns that are lost."""
    strays: float = 0.1
    """The share of frames with a point in front of the car that nothing explains."""
    jitter: float = 0.0
    """The standard deviation of the error that all ranges of a frame share, m."""
    pitch: float = 0.0
    """The standard deviation of the pitch of the car from frame to frame, rad."""
    ring_offsets: float = 0.0
    """The standard deviation of the error that all ranges of a ring share for ever, m."""


class Panel(NamedTuple):
    """A part of a rear: a sheet over (y, height), curved across, slanted upwards, ``behind`` the bumper."""

    height: tuple[float, float]  # above the road, m
    half_width: float  # m
    behind: float  # m, at the lower edge in the middle
    slant: float  # m further ahead for each metre upwards
    curve: float  # 1/m: further ahead by curve * y^2
    reflectivity: float
    returns: float = 1.0  # share of rays that come back


CAR = (
    Panel((0.30, 0.58), 0.86, 0.00, 0.00, 0.10, 0.35),  # bumper
    Panel((0.58, 0.95), 0.84, 0.09, 0.06, 0.08, 0.45),  # tailgate
    Panel((0.68, 0.80), 0.26, 0.07, 0.00, 0.00, 0.95),  # number plate
    Panel((0.95, 1.42), 0.68, 0.14, 0.70, 0.10, 0.20, 0.4),  # rear window
)
"""The rear of a car; its bumper is 0.30 m above the road."""


class Pose(NamedTuple):
    """The place of a rear: its nearest point ahead of the sensor, and its middle to the left, m."""

    x: float
    y: float


def first_hit(panel: Panel, pose: Pose, across: Floats, upwards: Floats, height: float) -> Floats:
    """Return how far ahead each ray meets a panel, m; inf where it does not.

    A ray is at ``y = x across`` and ``z = x upwards``: what is met is a root of a quadratic in x.
    """
    low = panel.height[0] - height
    a = panel.curve * across**2
    b = panel.slant * upwards - 1.0 - 2.0 * panel.curve * pose.y * across
    c = pose.x + panel.behind - panel.slant * low + panel.curve * pose.y**2
    with np.errstate(invalid="ignore", divide="ignore"):
        x = 2.0 * c / (-b + np.sqrt(b**2 - 4.0 * a * c))
        inside = (np.abs(x * across - pose.y) <= panel.half_width) & (x > 0.0)
        inside &= (x * upwards >= low) & (x * upwards <= panel.height[1] - height)
    return np.where(inside, x, np.inf)


def turn(
    scanner: Scanner, rears: list[Pose], rng: np.random.Generator, nod: float = 0.0, rings: Floats | float = 0.0
) -> NDArray[np.float32]:
    """Return one turn over a road with cars on it: rows of x, y, z, reflectivity, ring after ring.

    ``nod`` is the pitch of the car (rad), and ``rings`` the error of each ring (m).
    """
    elevation, azimuth = (angle.ravel() for angle in np.meshgrid(scanner.rings, scanner.azimuths, indexing="ij"))
    offsets = np.repeat(np.broadcast_to(rings, len(scanner.rings)), len(scanner.azimuths))
    nod = nod + scanner.pitch * rng.standard_normal()
    across, upwards = np.tan(azimuth), np.tan(elevation + nod) / np.cos(azimuth)
    with np.errstate(divide="ignore"):
        nearest = np.where(upwards < 0.0, -scanner.height / upwards, np.inf)
    reflectivity, returns = np.full(len(across), ROAD_REFLECTIVITY), np.full(len(across), 1.0)
    for panel, pose in ((panel, pose) for pose in rears for panel in CAR):
        hit = first_hit(panel, pose, across, upwards, scanner.height)
        nearer = hit < nearest
        nearest[nearer], reflectivity[nearer], returns[nearer] = hit[nearer], panel.reflectivity, panel.returns
    seen = (nearest < 80.0) & (rng.random(len(nearest)) < returns * (1.0 - scanner.dropouts))
    nearest, reflectivity, offsets = nearest[seen], reflectivity[seen], offsets[seen]
    # The sensor believes the angles of its rings, whatever the car does.
    across, upwards = across[seen], (np.tan(elevation) / np.cos(azimuth))[seen]
    ray = np.sqrt(1.0 + across**2 + upwards**2)
    noise = scanner.range_noise * rng.standard_normal(len(ray)) + scanner.jitter * rng.standard_normal()
    x = nearest + (noise + offsets) / ray
    brightness = np.clip(reflectivity + 0.05 * rng.standard_normal(len(x)), 0.0, 0.99)
    points = np.column_stack([x, x * across, x * upwards, brightness])
    if rng.random() < scanner.strays and rears:
        ahead = min(pose.x for pose in rears) - rng.uniform(0.1, 2.0)
        points = np.vstack([points, [ahead, rng.uniform(-0.8, 0.8), rng.uniform(0.4, 1.2) - scanner.height, 0.4]])
    return points.astype(np.float32)


GATE = Gate.above_road(1.73, clearance=0.25, headroom=2.0, x=(2.0, np.inf))
"""The gate of what is above the road, in the own lane, and not the own bonnet."""


class Frame(NamedTuple):
    """A cloud, its stamp, and the truth at that time."""

    stamp: float  # s
    points: NDArray[np.float32]
    distance: float  # m, from the sensor
    closing_speed: float  # m/s

    @property
    def ttc(self) -> float:
        """The TTC at the closing speed of the frame, s."""
        return self.distance / self.closing_speed if self.closing_speed > 0.0 else np.inf


@dataclass(frozen=True)
class Approach:
    """A gap that shrinks, first at a constant closing speed, then at one that grows."""

    name: str
    distance: float
    """The distance from the sensor to the bumper ahead at first, m."""
    closing_speed: float
    """The closing speed at first, m/s."""
    acceleration: float = 0.0
    """The change of the closing speed, m/s^2."""
    since: float = 0.0
    """The time at which the acceleration begins, s."""
    duration: float = 2.0
    """The time after which the approach ends, s."""
    drift: float = 0.1
    """The speed of the car ahead to the side, m/s."""
    scanner: Scanner = field(default_factory=Scanner)

    def truth(self, t: float) -> tuple[float, float]:
        """Return distance and closing speed at a time."""
        later = max(t - self.since, 0.0)
        gone = self.closing_speed * t + self.acceleration * later**2 / 2.0
        return self.distance - gone, self.closing_speed + self.acceleration * later

    def frames(self, seed: int) -> list[Frame]:
        """Return what the scanner sees, turn by turn, while anything is left of the gap."""
        rng = np.random.default_rng(seed)
        y = rng.uniform(-0.3, 0.3)
        frames = []
        for stamp in np.arange(round(self.duration * RATE) + 1) / RATE:
            distance, closing = self.truth(stamp)
            if distance < 3.0:
                break
            points = turn(self.scanner, [Pose(distance, y + self.drift * stamp)], rng)
            frames.append(Frame(float(stamp), points, distance, closing))
        return frames


STEADY = tuple(
    Approach(f"{speed:g} m/s from {distance:g} m", distance, speed)
    for speed, distance in ((0.5, 8), (1, 12), (1, 6), (2, 12), (2, 30), (5, 20), (10, 28), (15, 40))
)
CHANGING = tuple(
    Approach(f"{speed:g} m/s from {distance:g} m, {change:+g} m/s^2", distance, speed, change, since)
    for speed, distance, change, since in (
        (0.6, 8, 0.2, 0.0),
        (1, 15, 0.3, 0.0),
        (1, 15, 1.0, 0.0),
        (2, 25, 4.0, 0.5),
        (8, 20, -6.0, 0.0),
        (10, 30, -4.0, 0.3),
        (15, 45, -5.0, 0.5),
    )
)
STANDING = tuple(Approach(f"standing {distance:g} m behind", distance, 0.0, drift=0.0) for distance in (4, 8, 20, 40))


ROAD = Scanner(jitter=0.001, ring_offsets=0.018)
"""A scanner whose rings disagree by as much as those of KITTI."""


STEP = 0.01
"""The step of simulated motion, s."""
EVERY = round(1.0 / (RATE * STEP))
"""The steps from one frame to the next."""
NEAREST = 3.0
"""A drive ends before the gap is smaller than this, m."""


@dataclass(frozen=True)
class RoadDrive:
    """A car that is followed on a road: drivers correct their speed all the time, and the own car nods slowly.

    The closing acceleration is random with a memory of 0.6 s, and smoothed over 0.15 s, as pedals and engines are. The
    nod is a damped oscillation of 1.2 Hz that the road shakes.
    """

    seed: int
    duration: float = 4.0  # s
    nod: float = np.radians(0.06)
    """The standard deviation of the pitch, rad."""
    scanner: Scanner = ROAD

    def frames(self) -> list[Frame]:
        """Return what the scanner sees, turn by turn, while anything is left of the gap."""
        rng = np.random.default_rng([2026, self.seed])
        distances, speeds = self._motion(rng)
        pitch = self._pitch(rng, STEP, len(distances))
        rings = self.scanner.ring_offsets * rng.standard_normal(len(self.scanner.rings))
        y, drift = rng.uniform(-0.3, 0.3), rng.uniform(-0.1, 0.1)
        frames = []
        for now in range(0, len(distances), EVERY):
            if distances[now] < NEAREST:
                break
            rear = Pose(float(distances[now]), y + drift * STEP * now)
            points = turn(self.scanner, [rear], rng, float(pitch[now]), rings)
            frames.append(Frame(STEP * now, points, float(distances[now]), float(speeds[now])))
        return frames

    def motion(self) -> tuple[Floats, Floats]:
        """Return distance and closing speed of each frame, while anything is left of the gap."""
        distances, speeds = (each[::EVERY] for each in self._motion(np.random.default_rng([2026, self.seed])))
        left = np.append(distances < NEAREST, True).argmax()
        return distances[:left], speeds[:left]

    def _motion(self, rng: np.random.Generator) -> tuple[Floats, Floats]:
        acceleration = self._acceleration(rng, STEP, round(self.duration / STEP) + 1)
        speed = rng.uniform(0.5, 4.0) + STEP * np.cumsum(acceleration)
        return rng.uniform(6.0, 14.0) + 1.5 * speed[0] - STEP * np.cumsum(speed), speed

    def _acceleration(self, rng: np.random.Generator, step: float, count: int) -> Floats:
        size, kept = rng.choice([0.3, 0.5, 1.0]), np.exp(-step / 0.6)
        pushes = 1.6 * size * np.sqrt(1.0 - kept**2) * rng.standard_normal(count)
        pedal, now = 0.0, size * rng.standard_normal()
        out = np.empty(count)
        for i, push in enumerate(pushes):
            out[i] = now
            pedal = kept * pedal + push
            now += (pedal - now) * step / 0.15
        return out

    def _pitch(self, rng: np.random.Generator, step: float, count: int) -> Floats:
        natural, damping = 2.0 * np.pi * 1.2, 0.3
        angle = rate = 0.0
        out = np.empty(count)
        for i, bump in enumerate(rng.standard_normal(count)):
            out[i] = angle
            rate += (-2.0 * damping * natural * rate - natural**2 * angle) * step + bump * np.sqrt(step)
            angle += rate * step
        return np.asarray(self.nod * out / max(out.std(), 1e-9))
