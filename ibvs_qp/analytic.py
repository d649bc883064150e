"""PaperController: the published analytic law, corrected, behind the same interface; baseline and fallback."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.command import ActiveLimit, Command, Outcome
from ibvs_qp.config import ControllerConfig
from ibvs_qp.gate import MeasurementGate, answered_stamp, check_reference
from ibvs_qp.hold import hold_thrusts
from ibvs_qp.limits.thrust import thrust_window
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.setpoints import Setpoints

#: Singular values below this share of the largest are dropped in the pseudo-inverse of L.
RANK_TOLERANCE = 0.05


def analytic_wrench(terms: Setpoints) -> np.ndarray:
    r"""Control wrench tau of the paper, equations 4 to 16 as corrected in the design, section 3.

    .. math::
        \tau = (I-\Lambda)\,\tau_{vs} + \Lambda \tau_f, \quad
        \tau_{vs} = -M [L^\dagger (K_p e + K_d \dot e + K_i \textstyle\int e) + (I - L^\dagger L)\tau_p],
        \quad \Lambda = \mathrm{blockdiag}(\lambda n n^T, 0).

    L stacks the rho row of every line and ONE angle row, that of the line nearest the image centre. Stacking the
    angle rows of a horizontal and a vertical line as printed makes their difference command pitch through a lever
    of rho: measured, a vertical edge entering the picture pitched the vehicle by 14 degrees.

    Returns:
        Wrench beyond feedback linearisation [N, N m], (6,).
    """
    config = terms.config
    gains, vehicle = config.gains, config.vehicle
    mass = np.concatenate((np.full(3, vehicle.mass_kg), np.asarray(vehicle.inertia_kg_m2)))
    complementary = np.zeros(6)
    complementary[:3] = (
        terms.normal * (terms.standoff_command / vehicle.mass_kg)
        + terms.right * terms.velocity_command[0]
        + terms.down * terms.velocity_command[1]
    )
    complementary[3:] = terms.angular
    acceleration = complementary
    if terms.lines:
        rows, wanted = [], []
        for line in terms.lines:
            rows.append(line.matrix[0])
            wanted.append(
                -(gains.line_kp * line.rho_error + gains.line_kd * line.rho_rate + gains.line_ki * line.integral)
            )
        level = min(terms.lines, key=lambda line: abs(line.rho))
        rows.append(level.matrix[1])
        wanted.append(-(gains.theta_kp * level.angle_error + gains.theta_kd * level.angle_rate))
        matrix = np.vstack(rows)
        inverse = np.linalg.pinv(matrix, rcond=RANK_TOLERANCE)
        acceleration = inverse @ np.array(wanted) + complementary - inverse @ (matrix @ complementary)
    motion = mass * acceleration
    share = terms.contact_weight
    along = float(terms.normal @ motion[:3])
    motion[:3] += terms.normal * share * (terms.push_command - along)
    return motion


def analytic_thrusts(terms: Setpoints) -> np.ndarray:
    """Unclipped thrusts of the analytic law: feedback linearisation and pseudo-inverse allocation [N], (n,)."""
    return terms.inverse @ (analytic_wrench(terms) - terms.bias_wrench)


class PaperController:
    """The paper's law with the same measurement, reference and command as the program."""

    def __init__(self, config: ControllerConfig | None = None) -> None:
        self.config = config or ControllerConfig()
        self.setpoints = Setpoints(self.config)
        vehicle = self.config.vehicle
        self._gate = MeasurementGate(vehicle.geometry.count)
        self._floor, self._ceiling = vehicle.thrust_min, vehicle.thrust_max
        self._step = vehicle.thrust_rate_n_s * self.config.tick_s
        self.reset()

    def reset(self) -> None:
        """As after construction."""
        self.setpoints.reset()
        self._gate.reset()
        self._last: np.ndarray | None = None
        self._reference = Reference()

    def step(self, measurement: Measurement, reference: Reference) -> Command:
        """Thrusts for one tick; never raises, clips to box and rate."""
        checked, rejected = self._gate.check(measurement)
        reference, refused = check_reference(reference, self._reference)
        self._reference = reference
        outcome, mode = Outcome.SOLVED, "hold"
        low, high = self._floor, self._ceiling
        if checked is None:
            free, outcome = hold_thrusts(self.config, self._gate.inertial), Outcome.HOLD
        else:
            if self._gate.restarted:
                self.setpoints.reset()
            self.setpoints.update(checked, reference)
            free = analytic_thrusts(self.setpoints)
            mode = "contact" if self.setpoints.contact.in_contact else ("approach" if reference.contact else "free")
            low = low if checked.thrust_min is None else np.maximum(checked.thrust_min, low)
            high = np.maximum(low, high if checked.thrust_max is None else np.minimum(checked.thrust_max, high))
            if not np.isfinite(free).all():
                free, outcome, mode = hold_thrusts(self.config, checked), Outcome.HOLD, "hold"
        last, step = (free, math.inf) if self._last is None else (self._last, self._step)
        low, high = thrust_window(last, low, high, step, self._floor, self._ceiling)
        thrusts = np.clip(free, low, high)
        unallocated = self.setpoints.effectiveness @ (free - thrusts)
        self._last = thrusts
        self.setpoints.note(thrusts, unallocated)
        return Command(
            stamp_ns=answered_stamp(measurement),
            thrusts=thrusts,
            wrench=self.setpoints.effectiveness @ thrusts,
            outcome=outcome,
            mode=mode,
            rejected=rejected + refused,
            active_limits=self._clipped(free, thrusts),
            unallocated_wrench=unallocated,
            reach_margin=self.setpoints.reach - max(self.setpoints.contact.push, 0.0) if checked else math.nan,
        )

    def _clipped(self, free: np.ndarray, thrusts: np.ndarray) -> tuple[ActiveLimit, ...]:
        names = self.config.vehicle.geometry.names
        return tuple(
            ActiveLimit(
                name=f"thrust_{names[i]}",
                side="upper" if free[i] > thrusts[i] else "lower",
                price=math.nan,
                slack=abs(float(free[i] - thrusts[i])),
                unit="N",
            )
            for i in np.flatnonzero(np.abs(free - thrusts) > 1e-9)
        )
