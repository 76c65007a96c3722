"""From time-to-collision to a decision: when to brake, and why."""

from ttc_fast.brake.command import Command, Counters, Decision, Reason
from ttc_fast.brake.controller import BrakeController
from ttc_fast.brake.criteria import (
    EstimateThreshold,
    IttcThreshold,
    RssDistance,
    StoppingDistance,
    SweptPathThreshold,
)
from ttc_fast.brake.scene import Criterion, Evaluation, Needs, Threats
from ttc_fast.brake.sight import Estimate, Motion, Source, Threat

__all__ = [
    "BrakeController",
    "Command",
    "Counters",
    "Criterion",
    "Decision",
    "Estimate",
    "EstimateThreshold",
    "Evaluation",
    "IttcThreshold",
    "Motion",
    "Needs",
    "Reason",
    "RssDistance",
    "Source",
    "StoppingDistance",
    "SweptPathThreshold",
    "Threat",
    "Threats",
]
