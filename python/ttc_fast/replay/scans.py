"""Scans: what each beam, or the vehicle's path, runs into."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

from ttc_fast.replay.controller import ReplayController, motion_of
from ttc_fast.replay.row import Row
from ttc_fast.replay.settings import SCANNER

if TYPE_CHECKING:
    from ttc_fast.logs import ScanFrame, ScanLog
    from ttc_fast.replay.settings import Settings


class Scans:
    """Frames of a log of scans to rows.

    Parameters
    ----------
    log : ScanLog
        Of the frames.
    settings : Settings
        Of scanner and brake.

    Raises
    ------
    ConfigurationError
        If a setting makes no sense.
    """

    name: ClassVar[str] = "a log of scans"
    uses: ClassVar[tuple[str, ...]] = SCANNER

    def __init__(self, log: ScanLog, settings: Settings) -> None:
        self._settings = settings
        self._configuration = settings.configured()
        told = {name: value for name, value in vars(log.scanner).items() if value is not None}
        self.scan = self._configuration.scanner(**told)
        merged = {**told, **self._configuration.scan}
        self.outline, self.mount = merged.get("outline"), tuple(merged.get("mount", (0.0, 0.0, 0.0)))
        self.about = _about(log, self.outline, self.mount)
        self.rated = False
        self.controller = self._make_controller()

    def _make_controller(self, *, rated: bool = False) -> ReplayController:
        if rated and self._configuration.range_rate is None:
            self._configuration = replace(self._configuration, range_rate={})
        return ReplayController(
            self._configuration,
            self._settings.sensor_timeout,
            scan=self.scan,
            sees_path=self.outline is not None,
        )

    def begin(self, frame: ScanFrame) -> None:
        """Look at the first frame: without a speed, the ranges have to tell what closes."""
        self.rated = frame.speed is None
        if self.rated:
            self.controller = self._make_controller(rated=True)

    def row(self, number: int, frame: ScanFrame) -> Row:
        """Put a frame through the brake."""
        stamp, speed = frame.stamp, frame.speed
        self.controller.is_reset(stamp)
        decision, threats, status = self.controller.decide(stamp, motion_of(frame), ranges=frame.ranges, stamp=stamp)
        criterion = decision.criterion
        now = math.nan if speed is None else speed
        seen = None if threats is None else threats.path or threats.beams
        if seen is None or threats is None or criterion is None:
            return Row(
                number, stamp, math.nan, math.nan, math.inf, status, decision.command, decision.reason, speed=now
            )
        return Row(
            number,
            stamp,
            seen.clearance,
            seen.closing_speed,
            seen.ttc,
            seen.status,
            decision.command,
            decision.reason,
            math.nan,
            math.nan,
            math.nan,
            math.nan,
            now,
            threats.returns,
            criterion.name,
            decision.value,
            decision.threshold,
            seen.index,
            seen.range,
            seen.angle,
        )


def _about(log: ScanLog, outline: Any, mount: tuple[float, ...]) -> list[tuple[str, str]]:
    """Say what the numbers rest on, for people."""
    x, y, yaw = mount
    scanner = f"{log.scanner.beams} beams, at x {x:g} m, y {y:g} m, yaw {yaw:g} rad"
    if outline is None:
        problem = "from the scanner, so TTC is too long by (scanner to edge of the vehicle) / closing speed"
        return [("scanner", scanner), ("distance", f"{problem}; --outline says where the vehicle ends")]
    rear, front, right, left = outline
    return [
        ("scanner", scanner),
        ("distance", f"from the outline, x {rear:g} to {front:g} m, y {right:g} to {left:g} m"),
    ]
