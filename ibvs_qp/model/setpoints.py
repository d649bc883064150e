"""Setpoints of one step, common to both laws: from measurement and reference to the compiled step function."""

from __future__ import annotations

import contextlib
import copy
import dataclasses
import difflib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from allocation import WrenchFacets
from allocation.reach import ray_reach
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.errors import ConfigError, shown
from ibvs_qp.config.settings import adjusted
from ibvs_qp.estimation.contact import no_contact, read_contact
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.frames import camera_twist_matrix
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.model.hover import hold_thrusts
from ibvs_qp.model.inputs import LINE_OUTPUTS, RUN_TIME, setting_values
from ibvs_qp.model.interaction_matrix import line_interaction_matrix
from ibvs_qp.model.model import Model
from ibvs_qp.model.packing import KEPT, StepInputs
from ibvs_qp.model.reach import UNBOUNDED, thrust_window
from ibvs_qp.model.tick import TickFunction

#: Thrust step without a rate limit, before the first command [N].
ANY_STEP = 1e6


@dataclass(frozen=True, kw_only=True)
class LineSetpoint:
    """Errors and rates of one line at this step; see `ibvs_qp.tasks.line.LineState`.

    Attributes:
        matrix: Interaction matrix in body axes, (2, 6).
        tip: Image of the tip's wall point, normalised.
    """

    role: str
    rho: float
    theta: float
    tip: tuple[float, float]
    matrix: np.ndarray
    error: float
    rate: float
    integral: float
    rho_error: float
    rho_rate: float
    analytic_command: float
    angle_error: float
    angle_rate: float
    angle_command: float
    weight: float


def _number(name: str, index: int, text: str) -> property:
    """Read-only output of the last step as a plain number."""
    return property(lambda setpoints: setpoints.result(setpoints.step.starts[name] + index), doc=text)


class Setpoints:
    """Targets, bias wrench, reach and thrust window of one step, and the data of the program built on the same model.

    Attributes:
        model: The equations.
        step: The compiled function.
        free: Fraction of the directions right and down that no line fixes, (2,).
        last: Last commanded thrusts [N], (n,), None before the first.
    """

    STATE = ("config", "_contact", "_stamp", "last", "_change", "_unallocated")

    def __init__(self, model: Model, extra: Sequence[ca.SX] = ()) -> None:
        config = self.config = model.config
        vehicle = config.vehicle
        self.model = model
        self.effectiveness, self.mass_matrix = model.effectiveness, vehicle.mass_matrix
        self.inverse = np.linalg.pinv(self.effectiveness)
        self._facets: WrenchFacets | None = None
        self.step = TickFunction(model, extra)
        self._sensed = sensed = self.step.sensed
        self._parameters = [(sensed[entry.name], entry) for entry in model.parameters]
        self._inputs = StepInputs(self.step, config.line_slots)
        self._twist = camera_twist_matrix(np.array(vehicle.camera_position_m))
        self.result, out = self.step.results.item, self.step.outputs
        self._estimate = sum(len(view) for name, view in out.items() if name.startswith("estimate."))  # comes first
        self._touching, self._known, self._push = (
            self.step.inputs[f"contact.{name}"].item for name in ("touching", "known", "push")
        )
        self.normal, self.right, self.down = out["normal"], out["axis_right"], out["axis_down"]
        self.turning_lever = out["turning_lever"]
        self.bias_wrench, self.velocity_command = out["bias_wrench"], out["velocity_command"]
        self.free, self.lower, self.upper = out["free"], out["thrust_lower"], out["thrust_upper"]
        self.floor, self.ceiling = sensed["thrust_floor"], sensed["thrust_ceiling"]
        self.floor[:], self.ceiling[:] = vehicle.thrust_min, vehicle.thrust_max
        self.write_settings(config)
        self._rate_step = vehicle.thrust_rate_n_s * config.tick_s
        self.reset()

    def write_settings(self, config: ControllerConfig) -> None:
        """Take over gains, weights and limits of a configuration that has the same equations."""
        self.config = config
        for name, value in setting_values(config).items():
            self._sensed[name][:] = value

    def adjust(self, values: Mapping[str, Any]) -> None:
        """Change gains, weights, limits and parameters of further tasks from the next step on; see `CheckedLaw`."""
        changes: dict[str, dict[str, Any]] = {}
        parameters = {parameter.name: parameter for _, parameter in self._parameters}
        for name, value in values.items():
            section, _, field = name.partition(".")
            if name not in parameters and field not in RUN_TIME.get(section, ()):
                known = [*parameters, *setting_values(self.config)]
                near = difflib.get_close_matches(name, known, n=1)
                hint = f"did you mean {near[0]!r}?" if near else f"these can: {', '.join(known)}"
                raise ConfigError(f"{name} = {shown(value)} is refused: it cannot change between steps; {hint}")
            if name not in parameters:
                changes.setdefault(section, {})[field] = value
            elif not np.isfinite(value).all() or np.size(value) not in (1, parameters[name].value.size):
                allowed = f"{parameters[name].value.size} finite numbers are needed"
                raise ConfigError(f"{name} = {shown(value)} is refused: {allowed}")
        sections: dict[str, Any] = {name: adjusted(self.config, name, fields) for name, fields in changes.items()}
        config = dataclasses.replace(self.config, **sections)
        for name in parameters.keys() & values.keys():
            parameters[name].value[:] = values[name]
        self.write_settings(config)

    @contextlib.contextmanager
    def without_trace(self) -> Iterator[None]:
        """Evaluate without a trace: states, outputs, pairs of lines and time are as before."""
        memory, own = self.step.memory.copy(), vars(self._inputs)
        inputs, others = {name: own[name] for name in KEPT}, (self._stamp, self._contact)
        own.update(copy.deepcopy(inputs))
        try:
            yield
        finally:
            self.step.memory[:] = memory
            own.update(inputs)
            self._stamp, self._contact = others

    def reset(self) -> None:
        """As before the first measurement."""
        self._contact: ContactState | None = no_contact(self.config)
        self.step.reset()
        self.step.results[:] = 0.0
        self._inputs.reset()
        self._stamp = -1
        self.last: np.ndarray | None = None
        self._change, self._unallocated = np.zeros(len(self.floor)), 0.0
        self.normal[:], self.right[:], self.down[:] = np.eye(3)
        self.step.outputs["reach"][0], self.step.outputs["least_push"][0] = UNBOUNDED, 0.0

    def pause(self) -> None:
        """Thrust window of a step without a measurement."""
        if self.last is None:
            self.lower[:], self.upper[:] = self.floor, self.ceiling
        else:
            low, high = self.floor, self.ceiling
            self.lower[:], self.upper[:] = thrust_window(self.last, low, high, self._rate_step, low, high)

    def update(self, measurement: Measurement, reference: Reference, contact: ContactState | None = None) -> None:
        """Evaluate the step function for validated inputs; without a contact it is estimated here."""
        stamp, elapsed = measurement.stamp_ns, self.config.tick_s
        if self._stamp >= 0:
            elapsed = max((stamp - self._stamp) * 1e-9, 0.0)
        self._stamp = stamp
        self.step.advance()
        self._inputs.write(measurement, reference, contact, elapsed)
        self._write_rotors(measurement)
        for view, parameter in self._parameters:
            view[:] = parameter.value
        self.step.evaluate()
        self._contact = contact

    def _write_rotors(self, measurement: Measurement) -> None:
        """Last thrusts and limits; limits of a measurement hold within those of the vehicle."""
        values, low, high = self._sensed, measurement.thrust_min, measurement.thrust_max
        started = self.last is not None
        values["thrust_last"][:] = self.last if started else hold_thrusts(self.config, measurement)
        values["thrust_change"][:], values["commanded"][0] = self._change, started
        values["unallocated"][0] = self._unallocated
        values["thrust_step"][0] = self._rate_step if started else ANY_STEP
        lowest = self.floor if low is None else np.maximum(low, self.floor)
        values["thrust_low"][:] = lowest
        values["thrust_high"][:] = self.ceiling if high is None else np.maximum(np.minimum(high, self.ceiling), lowest)

    def note(self, thrusts: np.ndarray, unallocated: float) -> np.ndarray:
        """Store the commanded thrusts, and the largest unallocated force or moment (anti-windup), for the next step.

        Returns:
            The stored copy, read-only: the caller of the controller may write into the command's own array.
        """
        own = thrusts.copy()
        own.setflags(write=False)  # it is in the reports of the command, too
        if self.last is not None:
            self._change = own - self.last
        self.last, self._unallocated = own, unallocated
        return own

    @property
    def contact(self) -> ContactState:
        """Wall and contact at this step: the caller's, or the estimate, which is read on first use."""
        if self._contact is None:
            self._contact = read_contact(self.step.results[: self._estimate].tolist())
        return self._contact

    @property
    def in_contact(self) -> bool:
        """Whether the tip touches the wall at this step."""
        return self._touching() != 0.0

    @property
    def contact_push(self) -> float:
        """Filtered push on the wall at this step [N]; NaN while no wall is known."""
        return self._push() if self._known() else math.nan

    roll = _number("angles", 0, "Roll [rad].")
    pitch = _number("angles", 1, "Pitch [rad].")
    yaw = _number("angles", 2, "Yaw away from the wall normal [rad].")
    push_reference = _number("push_reference", 0, "Push reference within reach [N].")
    push_command = _number("push_command", 0, "Force along n of the push task [N].")
    standoff_command = _number("standoff_command", 0, "Unfiltered force along n of the approach law [N].")
    friction = _number("friction", 0, "Estimated friction coefficient.")
    reach = _number("reach", 0, "Largest push that the thrust limits allow [N].")
    least_push = _number("least_push", 0, "Smallest push that they allow [N]; above the reach when they allow none.")
    reach_friction = _number("reach_friction", 0, "Friction coefficient assumed by the reach; 0 standing still.")
    contact_weight = _number("contact_weight", 0, "Lambda: 0 in free air or out of contact, 1 in contact.")

    @property
    def friction_measured(self) -> bool:
        """Whether a slide has measured the friction that the reach assumes."""
        return bool(self.step.outputs["friction_measured"].item())

    @property
    def derated(self) -> bool:
        """Whether the limits of this step are narrower than the vehicle's own."""
        low, high = self._sensed["thrust_low"], self._sensed["thrust_high"]
        return bool((low > self.floor).any() or (high < self.ceiling).any())

    def limiting_rotors(self) -> tuple[tuple[str, str, float], ...]:
        """Rotors at a limit at the reach of this step: name, "lower" or "upper", and that limit [N]."""
        self._facets = self._facets or WrenchFacets(self.effectiveness)
        limits = {"lower": self._sensed["thrust_low"], "upper": self._sensed["thrust_high"]}
        out, names = self.step.outputs, self.config.vehicle.geometry.names
        reach = ray_reach(self._facets, -out["static_wrench"], out["reach_direction"], *limits.values())
        return tuple((names[rotor], side, float(limits[side][rotor])) for rotor, side in reach.binding)

    @property
    def inertial_push(self) -> float:
        """Push on the wall without the force sensor [N]."""
        return self.step.outputs["inertial_push"].item()

    @property
    def wind_spread(self) -> float:
        """Standard deviation of the unexplained force along the wall [N]."""
        return self.step.outputs["wind_spread"].item()

    @property
    def carried_weight(self) -> float:
        """Weight that something else than the rotors carries [N]."""
        return self.step.outputs["carried_weight"].item()

    @property
    def angular_acceleration(self) -> list[float]:
        """Angular acceleration by the motors' model at the last step [rad/s^2], (3,)."""
        return self.step.outputs["angular_acceleration"].tolist()

    @property
    def modelled_force(self) -> list[float]:
        """Specific force by the motors' model, measured contact and observed force at the last step [m/s^2], (3,)."""
        return self.step.outputs["modelled_force"].tolist()

    @property
    def motors_force(self) -> list[float]:
        """Specific force by the motors' model at the last step [m/s^2], (3,)."""
        return self.step.outputs["motors_force"].tolist()

    @property
    def motor_thrusts(self) -> np.ndarray:
        """Thrusts behind the motors' lag and the filter of `missing_thrust` [N], (n,): a view."""
        return self.step.outputs["motor_thrusts"]

    @property
    def missing_thrust(self) -> np.ndarray:
        """Thrust that every rotor gives less than commanded [N], (n,): a view of the last step."""
        return self.step.outputs["missing_thrust"]

    @property
    def missing_noise(self) -> float:
        """Standard deviation of one entry of `missing_thrust` while the rotors follow [N]."""
        return self.step.outputs["missing_noise"].item()

    @property
    def angular(self) -> np.ndarray:
        """Targets of the roll, pitch and yaw accelerations [rad/s^2], (3,)."""
        return np.concatenate((self.step.outputs["level_command"], self.step.outputs["yaw_command"]))

    @property
    def plane(self) -> tuple[float, float, float, float]:
        """Wall plane (A, B, C, D) in C, D = -1."""
        a, b, c = self.step.outputs["plane"].tolist()
        return a, b, c, -1.0

    @property
    def lines(self) -> list[LineSetpoint]:
        """Lines with a reference, in the order of their references."""
        plane, (x, y) = self.plane, self.step.outputs["tip_image"].tolist()
        return [self._line(index, role, plane, (x, y)) for index, role in self._inputs.present]

    def _line(
        self, index: int, role: str, plane: tuple[float, float, float, float], tip: tuple[float, float]
    ) -> LineSetpoint:
        inputs, outputs, name = self.step.inputs, self.step.outputs, f"line_{index}"
        rho, theta = inputs[f"{name}.rho"].item(), inputs[f"{name}.theta"].item()
        values = {entry: outputs[f"{name}.{entry}"].item() for entry in LINE_OUTPUTS}
        matrix = line_interaction_matrix(rho, theta, plane) @ self._twist
        return LineSetpoint(role=role, rho=rho, theta=theta, tip=tip, matrix=matrix, **values)
