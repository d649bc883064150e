"""What another preset would have commanded on recorded inputs."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ibvs_qp.config.errors import out_of_range
from ibvs_qp.estimation.turned_camera import straightened
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.recording.comparison import step, unbroken
from ibvs_qp.recording.header import ASSURED, LAWS, PILOT, flown_controller
from ibvs_qp.recording.reader import RecordedFlight
from ibvs_qp.recording.ticks import STEP
from ibvs_qp.supervision.assured import Assured


@dataclass(kw_only=True)
class PresetComparison:
    """Commands of the recorded controller and of another, on the same inputs and so without feedback.

    Attributes:
        ticks: Ticks of the law compared.
        thrust_rms_n: Root mean square of the thrust differences over rotors and ticks [N].
        thrust_peak_n: Largest thrust difference [N].
        peak_tick: Its tick.
        push_ticks: Ticks with a weight on the push task under both.
        push_recorded_n: Mean force that the recorded push task commands [N], NaN without such ticks.
        push_preset_n: The same of the preset.
        push_rms_n: Root mean square of the difference [N].
        limits_recorded: Ticks at which each limit was active.
        limits_preset: The same of the preset.
        missing: As in `Replay`.
        complete: As in `Replay`.
    """

    ticks: int = 0
    thrust_rms_n: float = 0.0
    thrust_peak_n: float = 0.0
    peak_tick: int = 0
    push_ticks: int = 0
    push_recorded_n: float = math.nan
    push_preset_n: float = math.nan
    push_rms_n: float = math.nan
    limits_recorded: dict[str, int] = field(default_factory=dict)
    limits_preset: dict[str, int] = field(default_factory=dict)
    missing: int = 0
    complete: bool = True

    @property
    def same(self) -> bool:
        """Whether ticks were compared, and all thrusts are the same to the bit."""
        return self.ticks > 0 and self.thrust_peak_n == 0.0


def compare_preset(flight: RecordedFlight, preset: PilotConfig) -> PresetComparison:
    """Run the recorded controller and that of a preset on the recorded inputs.

    Args:
        flight: The log.
        preset: Its law and controller are taken; the supervisor's settings, too, where one supervised a controller.

    Returns:
        The comparison.

    Raises:
        ConfigError: When the recorded controller cannot be built, or the preset has another number of rotors.
    """
    recorded = flown_controller(flight.facts)
    other = _of_preset(flight.facts["kind"], preset)
    laws = [each.controller if isinstance(each, Assured) else each for each in (recorded, other)]
    counts = [law.config.vehicle.geometry.count for law in laws]
    if counts[0] != counts[1]:
        raise out_of_range("--preset", f"{counts[1]} rotors", "", f"the log has {counts[0]}")
    result = PresetComparison()
    squares, entries, pushes = 0.0, 0, []
    for tick in unbroken(flight, result):
        ours, theirs = step(recorded, tick), step(other, tick)
        if ours is None or theirs is None or tick.given.call != STEP:
            continue
        off = np.abs(theirs.thrusts - ours.thrusts)
        squares, entries, result.ticks = squares + float(off @ off), entries + len(off), result.ticks + 1
        if off.max() > result.thrust_peak_n:
            result.thrust_peak_n, result.peak_tick = float(off.max()), tick.given.tick
        _count(result.limits_recorded, (limit.name for limit in ours.active_limits))
        _count(result.limits_preset, (limit.name for limit in theirs.active_limits))
        if all(law.setpoints.contact_weight > 0.0 for law in laws):
            pushes.append([law.setpoints.push_command for law in laws])
    result.thrust_rms_n = math.sqrt(squares / max(entries, 1))
    if pushes:
        before, after = np.transpose(pushes)
        result.push_ticks = len(pushes)
        result.push_recorded_n, result.push_preset_n = float(before.mean()), float(after.mean())
        result.push_rms_n = float(np.sqrt(np.mean((after - before) ** 2)))
    result.complete = flight.complete
    return result


def _count(counts: dict[str, int], names: Iterable[str]) -> None:
    for name in names:
        counts[name] = counts.get(name, 0) + 1


def _of_preset(kind: str, preset: PilotConfig) -> Any:
    """The preset's controller, supervised where the recorded one was."""
    law = LAWS[preset.law](straightened(preset.controller) if kind == PILOT else preset.controller)  # type: ignore[abstract]
    return Assured(law, preset.safety) if kind == ASSURED else law
