"""PaperController: the published analytic law, corrected, behind the same interface; baseline and fallback."""

from __future__ import annotations

import numpy as np

from ibvs_qp.command import Command, Outcome
from ibvs_qp.config import ControllerConfig
from ibvs_qp.gate import MeasurementGate, answered_stamp
from ibvs_qp.hold import hold_thrusts
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.reference_gate import check_reference
from ibvs_qp.reporting import clipped_command, contact_mode, reach_note
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
        self._gate = MeasurementGate(self.config.vehicle.geometry.count)
        self.reset()

    def reset(self) -> None:
        """As after construction."""
        self.setpoints.reset()
        self._gate.reset()
        self._reference = Reference()

    def step(self, measurement: Measurement, reference: Reference) -> Command:
        """Thrusts for one tick; never raises, clips to box and rate."""
        checked, rejected = self._gate.check(measurement)
        reference, refused = check_reference(reference, self._reference)
        self._reference, rejected, terms = reference, rejected + refused, self.setpoints
        stamp = answered_stamp(measurement)
        if checked is None:
            terms.pause()
            return clipped_command(
                terms, stamp, hold_thrusts(self.config, self._gate.inertial), Outcome.HOLD, "hold", rejected
            )
        if self._gate.restarted:
            terms.restart()
        terms.update(checked, reference)
        free, outcome, mode = analytic_thrusts(terms), Outcome.SOLVED, contact_mode(terms, reference)
        if not np.isfinite(free).all():
            free, outcome, mode = hold_thrusts(self.config, checked), Outcome.HOLD, "hold"
        return clipped_command(terms, stamp, free, outcome, mode, rejected + reach_note(terms, reference))
