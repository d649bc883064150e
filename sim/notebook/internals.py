"""Access of the notebooks to internals of controller, program and strategy; the only module that depends on them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ibvs_qp.analytic import RANK_TOLERANCE, analytic_thrusts
from ibvs_qp.config import ControllerConfig, Gains, Weights
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.pilot.painting.command import PainterInput, PaintingCommand
from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.painting.painter import Painter
from ibvs_qp.pilot.painting.presser import Presser
from ibvs_qp.qp.solver import ProgramValues

#: A flight at the wall ends after this time in any case [s].
LONGEST_S = 10.0

#: Measurement and reference of one tick.
Tick = tuple[Measurement, Reference]
#: Solution x, (variables,), or None without one, and iterations, 0 where a solver does not report them.
Answer = tuple[np.ndarray | None, int]


class _PressAndSlide(Presser):
    """Press and slide without waiting for the lines to settle and without the way back."""

    def step(self, inputs: PainterInput) -> PaintingCommand:
        if inputs.time_s > LONGEST_S:
            self._end(inputs, f"ended after {LONGEST_S:g} s in {self.phase}", failed=True)
        return super().step(inputs)

    def _align(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        self._tip.u_reference = self._tip.along.u
        self._enter(inputs, "press", "lines settle on the way")
        return super()._press(inputs, dt)

    def _retreat(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        self._end(inputs, self.reason if self.failed else "pressed and slid")
        return super()._retreat(inputs, dt)


@dataclass(frozen=True, kw_only=True)
class WallJob:
    """Press at one place for `hold_s`, slide along the edge for `slide_s` [s], and end."""

    hold_s: float
    slide_s: float

    def strategy(self, config: PaintingConfig) -> Painter:
        """The strategy of one flight."""
        return _PressAndSlide(config, self.hold_s, self.slide_s)

    def expected_s(self, config: PaintingConfig, strokes: int) -> float:
        """Hold and slide [s]."""
        return self.hold_s + self.slide_s

    @property
    def plan(self) -> dict[str, float]:
        """Least durations of the phases [s]."""
        return {"press": self.hold_s, "paint": self.slide_s} if self.slide_s > 0.0 else {"press": self.hold_s}


@dataclass(frozen=True, kw_only=True)
class Program:
    """The quadratic program of one tick."""

    values: ProgramValues  # its non-zeros and bounds
    unlimited: np.ndarray  # its solution without limits, (variables,)
    free: np.ndarray  # thrusts without limits [N], (n,)
    limited: bool  # whether they violate a limit


@dataclass(frozen=True, kw_only=True)
class TickRecord:
    """One tick of the QP law, with the analytic law at the same set-points."""

    program: Program  # the tick's program
    contact_weight: float  # Lambda [-]
    lines: int  # number of lines in use
    push_reference: float  # commanded push [N]
    law_free: np.ndarray  # thrusts of the analytic law before clipping [N], (n,)
    law: np.ndarray  # the same after clipping [N], (n,)
    # the same with the pushing direction removed from L before its inversion [N], (n,); for lambda 0 or 1
    selected: np.ndarray


def record_program(controller: HybridController) -> Program:
    """Program of the controller's last tick."""
    data = controller.engine.data
    at = data.rows()[:, : len(data.free)] @ data.free
    return Program(
        values=ProgramValues(*(getattr(data, name).copy() for name in ProgramValues._fields)),
        unlimited=data.unlimited.copy(),
        free=data.free.copy(),
        limited=bool(((at < data.lower) | (at > data.upper)).any()),
    )


def record_tick(controller: HybridController) -> TickRecord:
    """The controller's last tick under both laws."""
    setpoints = controller.setpoints
    law_free = analytic_thrusts(setpoints)
    return TickRecord(
        program=record_program(controller),
        contact_weight=setpoints.contact_weight,
        lines=len(setpoints.lines),
        push_reference=setpoints.push_reference,
        law_free=law_free,
        law=np.clip(law_free, setpoints.lower, setpoints.upper),
        selected=_selected_thrusts(controller),
    )


def _selected_thrusts(controller: HybridController) -> np.ndarray:
    r"""Thrusts of the analytic law with :math:`(L S)^\dagger` in the place of :math:`S L^\dagger` [N], (n,).

    S removes the fraction lambda of the pushing direction. The printed law inverts L with that direction and then
    drops the motion along it.
    """
    setpoints = controller.setpoints
    vehicle, contact = setpoints.config.vehicle, setpoints.contact_weight
    mass = vehicle.mass_matrix
    along = (contact * setpoints.push_command + (1.0 - contact) * setpoints.standoff_command) / vehicle.mass_kg
    right, down = setpoints.velocity_command
    acceleration = np.append(
        setpoints.normal * along + setpoints.right * right + setpoints.down * down, setpoints.angular
    )
    selection = np.eye(6)
    selection[:3, :3] -= contact * np.outer(setpoints.normal, setpoints.normal)
    if setpoints.lines:
        level = min(setpoints.lines, key=lambda line: abs(line.rho))
        matrix = np.vstack([*(line.matrix[0] for line in setpoints.lines), level.matrix[1]]) @ selection
        target = [*(line.analytic_command for line in setpoints.lines), level.angle_command]
        inverse = np.linalg.pinv(matrix, rcond=RANK_TOLERANCE)
        acceleration = acceleration + inverse @ (np.array(target) - matrix @ acceleration)
    turning = contact * setpoints.turning_lever.dot(acceleration[3:]) / vehicle.mass_kg
    acceleration[:3] -= setpoints.normal * turning  # in contact the push accelerates the tip
    return setpoints.inverse @ (mass @ acceleration - setpoints.bias_wrench)


def paper_profile(weight: float) -> ControllerConfig:
    """The program that approaches the paper's law as the weight of the line rows grows.

    All null-space targets have weight 1 on the scale of mass-weighted acceleration, effort almost none. There are no
    barriers, line errors are measured at the image centre, and push and stand-off rows have no filter.
    """
    mass = ControllerConfig().vehicle.mass_kg
    tasks = {"level": 1.0, "yaw": 1.0, "velocity": 1.0, "push": 1.0 / mass**2}
    weights = Weights(line=weight, effort=1e-9, smoothness=0.0, line_sigma=1.0, **tasks)
    gains = Gains(push_filter_s=0.0)
    printed = ControllerConfig(gains=gains, analytic_line_point="centre", analytic_angle_row=True)
    return replace(printed, weights=weights, line_profile="paper", barriers=False)


def shipped_solver() -> Callable[[Program], Answer]:
    """The controller's engine with the shipped settings, on recorded programs."""
    engine = HybridController().engine

    def solve(program: Program) -> Answer:
        for name, values in (program.values._asdict() | {"unlimited": program.unlimited}).items():
            getattr(engine.data, name)[:] = values
        found = engine.solve()
        return (None, 0) if found is None else (found.x, found.iterations)

    return solve
