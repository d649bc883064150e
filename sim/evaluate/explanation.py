"""A recorded tick solved again: tasks, active limits, conflicting limits. Text and tables: `explanation_text`."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from ibvs_qp.command import Outcome
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.files import parse_toml
from ibvs_qp.config.settings import from_dict
from ibvs_qp.controller import qp_problem
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.pilot.push_report import REDUCED, RESTORED
from ibvs_qp.qp.explain import Explanation, LimitValue, TickReplay
from ibvs_qp.symbolic.signals import stack

if TYPE_CHECKING:
    from sim.flight.trace import Event, Trace

#: Log times carry rounding errors [s].
_TIME_TOLERANCE_S = 1e-6


#: Building the program of a configuration takes long; explanations need it several times.
_program = functools.lru_cache(maxsize=2)(qp_problem)


def _replay(
    trace: Trace, tick: int, config: PilotConfig, solver: str | None = None
) -> tuple[TickReplay, Explanation | None]:
    """Solve the program of one tick again; the only access to the recorded inputs of the program."""
    problem = _program(config.controller)
    if trace.thrusts.shape[1] != problem.model.rotors:
        raise ConfigError(f"the log has {trace.thrusts.shape[1]} thrusts, its preset {problem.model.rotors} rotors")
    replay = TickReplay(problem, solver)
    return replay, replay.explain(trace.arrays["program"][tick].astype(float))


def thrust_window(trace: Trace, tick: int, config: PilotConfig) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper thrusts in the program of a tick: box, deratings and rate limit [N], (n,) each."""
    names = [f"thrust_{name}" for name in config.controller.vehicle.geometry.names]
    rows = _replay(trace, tick, config)[0].limit_values(names, trace.thrusts[tick])
    return np.array([row.lower for row in rows]), np.array([row.upper for row in rows])


def flown_config(trace: Trace) -> PilotConfig:
    """Configuration of a recorded flight.

    Raises:
        ConfigError: When the log's preset is refused.
    """
    try:
        return from_dict(PilotConfig, parse_toml(trace.preset, "preset"))
    except ConfigError as error:
        raise ConfigError(f"the log's preset is refused: {error}") from None


def explain_tick(trace: Trace, tick: int, solver: str | None = None) -> tuple[PilotConfig, Explanation | None]:
    """Configuration flown and the explanation of one tick of a QP flight, by the exact solver or a named one."""
    config = flown_config(trace)
    return config, _replay(trace, tick, config, solver)[1]


def explain_conflict(trace: Trace, tick: int) -> tuple[LimitValue, ...]:
    """A smallest set of hard limits that contradict each other, with their values at the flown thrusts; or ()."""
    replay, _ = _replay(trace, tick, flown_config(trace))
    return replay.limit_values(replay.conflict, trace.thrusts[tick])


@dataclass(frozen=True, kw_only=True)
class TrimReport:
    """Deliberate tilt of a tick (`ibvs_qp.model.trim_tilt`).

    Attributes:
        roll_deg, pitch_deg: That is flown to [deg].
        reach_n: Greatest push at the attitude of the tick [N].
        level_reach_n: The same in level flight [N].
    """

    roll_deg: float
    pitch_deg: float
    reach_n: float
    level_reach_n: float


@functools.lru_cache(maxsize=2)
def _trim_function(config: ControllerConfig) -> ca.Function:
    signals = _program(config).model.signals
    point = ca.vertcat(stack(signals.inputs), stack(signals.states))
    return ca.Function("trim", [point], [signals.outputs[name] for name in ("trim_tilt", "reach", "level_reach")])


def trim_tilt(trace: Trace, tick: int, config: PilotConfig) -> TrimReport | None:
    """Deliberate tilt of a recorded tick; None where the mission does not permit one."""
    if config.controller.limits.trim_deg == 0.0:
        return None
    angles, reach, level = _trim_function(config.controller)(trace.arrays["program"][tick].astype(float))
    roll, pitch = np.degrees(np.array(angles).ravel())
    return TrimReport(roll_deg=roll, pitch_deg=pitch, reach_n=float(reach), level_reach_n=float(level))


def has_no_program(trace: Trace, tick: int) -> bool:
    """Whether the outcome is ``hold``: the program in the tick's log row is then that of an earlier tick."""
    return trace.outcomes[int(trace.outcome[tick])] == Outcome.HOLD


def rejections(trace: Trace, tick: int) -> list[Event]:
    """Events of rejected inputs up to this tick; the log holds the first event of each kind."""
    now = float(trace.t[tick]) + _TIME_TOLERANCE_S
    return [event for event in trace.events if event.kind == "rejected" and event.t <= now]


def push_reduction(trace: Trace, tick: int) -> str:
    """Why the push is below the job's up to this tick, by the events of the flight; empty while it is not."""
    now = float(trace.t[tick]) + _TIME_TOLERANCE_S
    events = [event for event in trace.events if event.kind in (REDUCED, RESTORED) and event.t <= now]
    return events[-1].text if events and events[-1].kind == REDUCED else ""
