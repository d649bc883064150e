"""From measurement and reference to what is wanted of every direction: shared word for word by both laws."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from allocation.effectiveness import control_effectiveness
from ibvs_qp.config import LONGEST_TICK, ControllerConfig
from ibvs_qp.estimation.contact import ContactEstimator
from ibvs_qp.frames import camera_twist_matrix, down_in_body
from ibvs_qp.limits.thrust import thrust_window
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.model.equations import setpoint_model
from ibvs_qp.model.lines import LINE_TERMS
from ibvs_qp.model.packing import TickInputs
from ibvs_qp.model.pairing import LineTerm
from ibvs_qp.model.program import program_parameters
from ibvs_qp.model.reach import UNBOUNDED
from ibvs_qp.model.signals import Signals
from ibvs_qp.model.tick_function import TickFunction
from ibvs_qp.qp.problem import QpTemplate
from ibvs_qp.safety.hover import hold_thrusts

#: Thrust step that stands for "no rate limit" before the first command [N].
ANY_STEP = 1e6

_NO_LIMITS: tuple[list[float] | None, list[float] | None] = (None, None)


def _number(name: str, index: int, text: str) -> property:
    """Read-only result of the last tick as a plain number."""
    return property(lambda terms: terms.result(terms.tick.starts[name] + index), doc=text)


class Setpoints:
    """Wanted forces and accelerations of one tick, and with a program given its data too: one compiled function.

    Attributes:
        contact: Contact estimator; everything else lives in the compiled tick (`ibvs_qp.model.equations`).
        tick: The compiled function; with a program its `extra` arrays are those of
            `ProgramData`.
        result: A result of the last tick by its place in the column of all of them.
    """

    def __init__(self, config: ControllerConfig, template: QpTemplate | None = None) -> None:
        self.config = config
        vehicle = config.vehicle
        self.effectiveness = control_effectiveness(vehicle.geometry)
        self.inverse = np.linalg.pinv(self.effectiveness)
        self.contact = ContactEstimator(config)
        signals = setpoint_model(config)
        program = _program(signals, config, template) if template else ()
        self.tick = TickFunction(signals, program, config.machine_code)
        self._inputs = TickInputs(self.tick, config.line_slots)
        self._twist = camera_twist_matrix(np.array(vehicle.camera_position_m))
        self.result = self.tick.results.item
        self._values, out = self.tick.inputs, self.tick.outputs
        self.normal, self.right, self.down = out["normal"], out["axis_right"], out["axis_down"]
        self.bias_wrench, self.angular = out["bias_wrench"], out["angular"]
        self.velocity_command, self.lower, self.upper = (
            out["velocity_command"],
            out["thrust_lower"],
            out["thrust_upper"],
        )
        self._change, self._thrusts = self._values["thrust_change"], self._values["thrust_last"]
        self._given_up: Any = self._values["given_up"].data
        self._values["thrust_floor"][:], self._values["thrust_ceiling"][:] = vehicle.thrust_min, vehicle.thrust_max
        self.reset()

    def reset(self) -> None:
        """As before the first measurement."""
        self.contact.reset()
        self.tick.reset()
        self._inputs.reset()
        self._stamp = -1
        values = self._values
        values["commanded"][0] = values["given_up"][0] = values["contact_weight"][0] = 0.0
        values["thrust_change"][:] = 0.0
        values["thrust_step"][0] = ANY_STEP
        values["thrust_low"][:], values["thrust_high"][:] = values["thrust_floor"], values["thrust_ceiling"]
        self._limits = _NO_LIMITS
        self.last: np.ndarray | None = None
        self.normal[:], self.right[:], self.down[:] = np.eye(3)
        self.tick.outputs["reach"][0], self.tick.outputs["least_push"][0] = UNBOUNDED, 0.0

    def restart(self) -> None:
        """As before the first measurement, but the rotors go on from where they are: the clock was set anew."""
        last, change = self.last, self._values["thrust_change"].copy()
        self.reset()
        if last is not None:
            self.note(last, 0.0)
            self._values["thrust_change"][:] = change

    def pause(self) -> None:
        """Thrust window of a tick without a measurement."""
        low, high, last = self._values["thrust_floor"], self._values["thrust_ceiling"], self.last
        if last is None:
            self.lower[:], self.upper[:] = low, high
        else:
            step = float(self._values["thrust_step"][0])
            self.lower[:], self.upper[:] = thrust_window(last, low, high, step, low, high)

    def update(self, measurement: Measurement, reference: Reference) -> None:
        """Take in one checked measurement and reference."""
        config, values = self.config, self._values
        stamp = measurement.stamp_ns
        dt = config.tick_s
        if self._stamp >= 0:
            dt = (stamp - self._stamp) * 1e-9
            dt = LONGEST_TICK if dt > LONGEST_TICK else dt if dt > 0.0 else 0.0
        self._stamp = stamp
        force = measurement.specific_force
        contact = self.contact.update(
            stamp_ns=stamp,
            angular_velocity=measurement.angular_velocity.tolist(),
            specific_force=None if force is None else force.tolist(),
            down=down_in_body(measurement.attitude),
            contact_wrench=measurement.contact_wrench,
            wrench_stamp_ns=measurement.wrench_stamp_ns,
            plane=measurement.plane,
            plane_stamp_ns=measurement.plane_stamp_ns,
        )
        self._inputs.write(measurement, reference, contact, dt)
        if self.last is None:
            values["thrust_last"][:] = hold_thrusts(config, measurement)
        low, high = measurement.thrust_min, measurement.thrust_max
        if low is not None or high is not None or self._limits is not _NO_LIMITS:
            limits = (None if low is None else low.tolist(), None if high is None else high.tolist())
            if limits != self._limits:
                self._limits = _NO_LIMITS if limits == _NO_LIMITS else limits
                self._narrow(low, high)
        self.tick()

    def _narrow(self, low: np.ndarray | None, high: np.ndarray | None) -> None:
        """Limits that a measurement brings hold within those of the vehicle."""
        values = self._values
        floor, ceiling = values["thrust_floor"], values["thrust_ceiling"]
        lowest = floor if low is None else np.maximum(low, floor)
        values["thrust_low"][:] = lowest
        values["thrust_high"][:] = np.maximum(ceiling if high is None else np.minimum(high, ceiling), lowest)

    def note(self, thrusts: np.ndarray, given_up: float) -> None:
        """Take note of what was commanded and of the largest force or moment given up (anti-windup)."""
        if self.last is None:
            values = self._values
            values["commanded"][0] = 1.0
            values["thrust_step"][0] = self.config.vehicle.thrust_rate_n_s * self.config.tick_s
        else:
            np.subtract(thrusts, self.last, self._change)
        self._thrusts[:] = thrusts
        self._given_up[0] = given_up
        self.last = thrusts

    roll = _number("angles", 0, "Roll [rad].")
    pitch = _number("angles", 1, "Pitch [rad].")
    yaw = _number("angles", 2, "Yaw away from the wall normal [rad].")
    push_reference = _number("push_reference", 0, "Push asked for, within reach [N].")
    push_command = _number("push_command", 0, "Force along n that the force law wants [N].")
    standoff_command = _number("standoff_command", 0, "Force along n that the approach wants [N].")
    friction = _number("friction", 0, "Friction coefficient believed.")
    reach = _number("reach", 0, "Largest push that the limits in force can hold [N].")
    least_push = _number("least_push", 0, "Smallest push that they can hold [N]; above the reach when they hold none.")
    reach_friction = _number("reach_friction", 0, "Friction coefficient that the reach counts on; 0 standing still.")
    free_right = _number("free", 0, "Share of the direction right that no line fixes.")
    free_down = _number("free", 1, "Share of the direction down that no line fixes.")

    @property
    def plane(self) -> tuple[float, float, float, float]:
        """Wall plane (A, B, C, D) in C, D = -1."""
        a, b, c = self.tick.outputs["plane"].tolist()
        return a, b, c, -1.0

    @property
    def contact_weight(self) -> float:
        """Lambda: 0 in free air or when told to keep away, 1 in contact."""
        return float(self._values["contact_weight"][0])

    @contact_weight.setter
    def contact_weight(self, value: float) -> None:
        self._values["contact_weight"][0] = value

    @property
    def lines(self) -> list[LineTerm]:
        """Terms of the lines that were paired, in the order of their references."""
        out, plane = self.tick.outputs, self.plane
        terms = []
        for slot, role in self._inputs.present:
            rho, theta, tip_x, tip_y, *_ = out[f"line_{slot}"].tolist()
            errors = dict(zip(LINE_TERMS, out[f"line_{slot}_terms"].tolist(), strict=True))
            place = {"rho": rho, "theta": theta, "tip_x": tip_x, "tip_y": tip_y}
            terms.append(LineTerm(role=role, plane=plane, twist_map=self._twist, **place, **errors))
        return terms


def _program(signals: Signals, config: ControllerConfig, template: QpTemplate) -> list[ca.SX]:
    """Data of the program at this tick's parameters, and the parameters themselves; unknown ones become inputs."""
    values = program_parameters(signals, config)
    parameters = [
        values[name] if name in values else signals.input(name, symbol.numel())
        for name, symbol in template.model.parameters.items()
    ]
    stacked = ca.densify(ca.vertcat(*parameters))
    return [*template.values.call([stacked]), stacked, *template.free.call([stacked])]
