"""From time-to-collision to a decision: when to brake, and why."""

from ttc_fast.brake.controller import BrakeController
from ttc_fast.brake.criteria import (
    EstimateThreshold,
    IttcThreshold,
    PresentArc,
    RssDistance,
    StoppingDistance,
    SweptPathThreshold,
)
from ttc_fast.brake.decision import Command, Counters, Decision, Reason
from ttc_fast.brake.settings import BrakeSettings
from ttc_fast.brake.types import Criterion, Estimate, Evaluation, Motion, Needs, Source, Threat, Threats

__all__ = [
    "BrakeController",
    "BrakeSettings",
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
    "PresentArc",
    "Reason",
    "RssDistance",
    "Source",
    "StoppingDistance",
    "SweptPathThreshold",
    "Threat",
    "Threats",
]
