"""The scenarios: each kind is a function of a random generator, with something in the way or not."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from evaluation.closed_loop.simulator import BODY, Mover, Plan, Scanner, World, arc, box, chain

if TYPE_CHECKING:
    from collections.abc import Callable

HALL = chain([[-20.0, -12.0], [60.0, -12.0], [60.0, 12.0], [-20.0, 12.0]], closed=True)
"""Walls far away on all sides."""

HALF_WIDTH = BODY[3]
FRONT = BODY[1]


@dataclass(frozen=True)
class Scenario:
    """One drive."""

    kind: str
    threat: bool
    """Whether something was put in the way; what really happens is seen by driving."""
    world: World
    plan: Plan
    scanner: Scanner = field(default_factory=Scanner)
    duration: float = 5.0
    """The time after which it ends, s."""
    unseen: bool = False
    """Whether it drives where no beam looks: to brake there is right."""
    restarts_at: float = math.inf
    """The time at which the controller forgets everything, as a node does that is started again, s."""
    goes_on: bool = False
    """Whether the driver goes on as planned when the brake lets go; otherwise the drive ends when the car stands."""
    says_so: bool = False
    """Whether he says what he would do, by ``commanded``."""


Random = np.random.Generator


def straight(rng: Random, threat: bool) -> Scenario:
    """A hall, with a board or a pole ahead or beside the way."""
    plan = Plan(rng.uniform(0.5, 8.0), acceleration=rng.choice([0.0, 0.0, rng.uniform(-1.0, 2.0)]))
    width = rng.uniform(0.15, 1.5)
    reach = HALF_WIDTH + width / 2.0
    aside = rng.uniform(-reach, reach) if threat else _sign(rng) * (reach + rng.uniform(0.25, 3.0))
    obstacle = box(_ahead(rng, plan), aside, rng.uniform(0.1, 0.5), width, 0.0)
    return Scenario("straight", threat, World(np.concatenate([HALL, obstacle])), plan)


def corridor(rng: Random, threat: bool) -> Scenario:
    """Walls on both sides, nearer than half a metre at times, and a box in the way or none."""
    plan = Plan(rng.uniform(0.5, 7.0))
    right, left = -rng.uniform(0.4, 2.0), rng.uniform(0.4, 2.0)
    walls = [chain([[-20.0, right], [80.0, right]]), chain([[-20.0, left], [80.0, left]])]
    if threat:
        walls.append(box(_ahead(rng, plan), rng.uniform(-0.25, 0.25), 0.4, rng.uniform(0.2, 0.5)))
    return Scenario("corridor", threat, World(np.concatenate(walls)), plan)


def curve(rng: Random, threat: bool) -> Scenario:
    """A ring that the car follows, with a box in it or none."""
    radius, side = rng.uniform(2.5, 10.0), _sign(rng)
    plan = Plan(min(rng.uniform(0.5, 6.0), math.sqrt(5.0 * radius)), curvature=side / radius)
    room = rng.uniform(0.6, 1.5)
    walls = [arc(radius + way, 0.0, 2.0 * math.pi, 0.0, side * radius) for way in (-room, room)]
    if threat:
        angle = min(_ahead(rng, plan) / radius, 4.0)
        x, y = radius * math.sin(angle), side * radius * (1.0 - math.cos(angle))
        walls.append(box(x, y, 0.3, rng.uniform(0.2, 0.5), side * angle))
    return Scenario("curve", threat, World(np.concatenate(walls)), plan)


def crossing(rng: Random, threat: bool) -> Scenario:
    """A walker crosses: in the way for a second or more when the car comes, or across long before or after."""
    plan = Plan(rng.uniform(0.5, 6.0))
    where = _ahead(rng, plan)
    arrival = where / plan.speed
    pace, side, length = rng.uniform(0.2, 0.8), _sign(rng), rng.uniform(0.4, 1.5)
    in_the_way = (length + 2.0 * HALF_WIDTH) / pace
    apart = rng.uniform(-0.4, 0.4) * in_the_way if threat else _sign(rng) * (0.5 * in_the_way + rng.uniform(2.5, 4.0))
    start = side * pace * (arrival + apart)
    walker = Mover(box(where, start, 0.3, length), (0.0, -side * pace))
    return Scenario("crossing", threat, World(HALL, (walker,)), plan, duration=min(arrival + 2.0, 8.0))


def following(rng: Random, threat: bool) -> Scenario:
    """A car ahead at the same speed, which brakes hard or drives on."""
    plan = Plan(rng.uniform(1.0, 7.0))
    gap = FRONT + plan.speed * rng.uniform(2.2, 3.5) + 0.5
    begins = rng.uniform(0.5, 2.0) if threat else math.inf
    lead = Mover(box(gap + 0.25, rng.uniform(-0.05, 0.05), 0.5, 0.3), (plan.speed, 0.0), begins, rng.uniform(3.0, 8.0))
    return Scenario("following", threat, World(HALL, (lead,)), plan, duration=6.0)


def overtaking(rng: Random, threat: bool) -> Scenario:
    """A slower car in the next lane, which stays there or pulls out."""
    plan = Plan(rng.uniform(2.0, 7.0))
    speed, side = plan.speed * rng.uniform(0.0, 0.6), _sign(rng)
    ahead = FRONT + plan.speed * rng.uniform(1.5, 3.0)
    aside = side * (2.0 * HALF_WIDTH + rng.uniform(0.25, 0.8))
    meets = ahead / (plan.speed - speed)
    across = -aside / (meets * rng.uniform(0.7, 1.2)) if threat else 0.0
    other = Mover(box(ahead + 0.25, aside, 0.5, 0.3), (speed, across))
    return Scenario("overtaking", threat, World(HALL, (other,)), plan, duration=min(meets + 1.0, 8.0))


def reversing(rng: Random, threat: bool) -> Scenario:
    """The car reverses, with the scanner at the rear, towards a wall or in the open."""
    plan = Plan(-rng.uniform(0.3, 3.0))
    walls = HALL
    if threat:
        where = BODY[0] - abs(plan.speed) * rng.uniform(2.0, 4.0)
        walls = np.concatenate([HALL, box(where - 0.2, rng.uniform(-0.3, 0.3), 0.3, rng.uniform(0.2, 2.0))])
    return Scenario("reversing", threat, World(walls), plan, Scanner(mount=(-0.05, 0.0, math.pi)))


def blind(rng: Random, threat: bool) -> Scenario:
    """A hall, with a scanner that sees nothing any more from some time on."""
    scenario = straight(rng, threat)
    return replace(scenario, kind="blind", scanner=Scanner(blind_from=rng.uniform(0.3, 2.0)))


def backing(rng: Random, threat: bool) -> Scenario:
    """The car reverses, with the scanner at the front, which does not look there."""
    return replace(reversing(rng, threat), kind="backing", scanner=Scanner(), unseen=True)


def restarting(rng: Random, threat: bool) -> Scenario:
    """A hall, with a controller that starts again on the way, and a driver who goes on when it lets go."""
    made = straight(rng, threat)
    at = rng.uniform(0.0, made.duration - 1.0)
    return replace(made, kind="restarting", restarts_at=at, goes_on=True, says_so=bool(rng.random() < 0.5))


def waiting(rng: Random, threat: bool) -> Scenario:
    """A walker crosses slowly; the car waits, and the driver, who says so, goes on when it is let go."""
    made = crossing(rng, threat)
    return replace(made, kind="waiting", goes_on=True, says_so=True, duration=made.duration + 3.0)


KINDS: tuple[Callable[[Random, bool], Scenario], ...] = (
    straight,
    corridor,
    curve,
    crossing,
    following,
    overtaking,
    reversing,
    blind,
    backing,
    restarting,
    waiting,
)


def scenario(seed: int, run: int) -> tuple[Scenario, Random]:
    """Return the scenario of a run, and the generator that goes on with its noise."""
    rng = np.random.default_rng([seed, run])
    made = KINDS[run % len(KINDS)](rng, bool(rng.random() < 0.5))
    return _with_faults(made, rng), rng


def _with_faults(made: Scenario, rng: Random) -> Scenario:
    """Give the scanner faults of its own."""
    scanner = replace(
        made.scanner,
        noise=rng.uniform(0.0, 0.03),
        dropouts=rng.uniform(0.0, 0.1),
        speckle=rng.choice([0.0, 1e-5, 1e-4]),
        latency=rng.uniform(0.0, 0.03),
    )
    return replace(made, scanner=scanner)


def _ahead(rng: Random, plan: Plan) -> float:
    """Return a place far enough ahead that it can be seen coming, m."""
    return FRONT + 0.5 + abs(plan.speed) * rng.uniform(1.8, 4.0)


def _sign(rng: Random) -> float:
    return float(rng.choice([-1.0, 1.0]))
