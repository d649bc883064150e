"""PaperController: the published analytic law, corrected, behind the same interface; baseline and fallback."""

from __future__ import annotations

import numpy as np

from ibvs_qp.command import Command, Outcome
from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.model.model import Model
from ibvs_qp.model.reporting import clipped_command, contact_mode, reach_note
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.safety.hover import hold_thrusts
from ibvs_qp.tasks import LevelTask, LineTask, PushTask, StandoffTask, VelocityTask, YawTask
from ibvs_qp.validation.measurement import MeasurementGate, answered_stamp
from ibvs_qp.validation.reference import check_reference

#: Singular values below this fraction of the largest are dropped in the pseudo-inverse of L.
RANK_TOLERANCE = 0.05


def analytic_wrench(setpoints: Setpoints) -> np.ndarray:
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
    config = setpoints.config
    gains, vehicle = config.gains, config.vehicle
    standoff, (right, down) = setpoints.standoff_command / vehicle.mass_kg, setpoints.velocity_command.tolist()
    axes = zip(setpoints.normal.tolist(), setpoints.right.tolist(), setpoints.down.tolist(), strict=True)
    complementary = np.array([n * standoff + r * right + d * down for n, r, d in axes] + setpoints.angular.tolist())
    acceleration = complementary
    lines = setpoints.lines  # made anew whenever they are read, and so are their matrices
    if lines:
        matrices, wanted = [line.matrix for line in lines], []
        for line in lines:
            wanted.append(
                -(gains.line_kp * line.rho_error + gains.line_kd * line.rho_rate + gains.line_ki * line.integral)
            )
        nearest = min(range(len(lines)), key=lambda index: abs(lines[index].rho))
        level = lines[nearest]
        wanted.append(-(gains.theta_kp * level.angle_error + gains.theta_kd * level.angle_rate))
        matrix = np.array([*(rows[0] for rows in matrices), matrices[nearest][1]])
        inverse = _pseudo_inverse(matrix)
        acceleration = inverse.dot(np.array(wanted)) + complementary - inverse.dot(matrix.dot(complementary))
    mass = vehicle.mass_kg
    motion = np.array((mass, mass, mass, *vehicle.inertia_kg_m2)) * acceleration
    force = motion[:3]
    along = float(setpoints.normal.dot(force))
    force += setpoints.normal * setpoints.contact_weight * (setpoints.push_command - along)
    return motion


def _pseudo_inverse(matrix: np.ndarray) -> np.ndarray:
    """`numpy.linalg.pinv` of a small matrix to the bit, without its handling of stacks: half the time."""
    left, singular, right = np.linalg.svd(matrix, full_matrices=False)
    values = singular.tolist()  # the largest first
    least = RANK_TOLERANCE * values[0]
    inverted = np.array([[1.0 / value if value > least else 0.0] for value in values])
    return np.matmul(right.T, inverted * left.T)


def analytic_thrusts(setpoints: Setpoints) -> np.ndarray:
    """Unclipped thrusts of the analytic law: feedback linearisation and pseudo-inverse allocation [N], (n,)."""
    return setpoints.inverse.dot(analytic_wrench(setpoints) - setpoints.bias_wrench)


def analytic_setpoints(config: ControllerConfig) -> Setpoints:
    """Targets of the tasks without a program: the analytic law combines them itself."""
    model = Model(config)
    lines = [LineTask(index) for index in range(config.line_slots)]
    for task in (*lines, PushTask(), StandoffTask(), LevelTask(), YawTask(), VelocityTask()):
        task.rows(model)
    return Setpoints(model)


class PaperController:
    """The paper's law with the same measurement, reference and command as the program."""

    def __init__(self, config: ControllerConfig | None = None) -> None:
        self.config = config or ControllerConfig()
        self.setpoints = analytic_setpoints(self.config)
        self._gate = MeasurementGate(self.config.vehicle.geometry.count)
        self.reset()

    def reset(self) -> None:
        """As after construction."""
        self.setpoints.reset()
        self._gate.reset()
        self._reference = Reference()

    def step(self, measurement: Measurement, reference: Reference, contact: ContactState | None = None) -> Command:
        """Thrusts for one tick; never raises, clips to box and rate; arguments as of `HybridController.step`."""
        checked, rejected = self._gate.check(measurement)
        reference, refused = check_reference(reference, self._reference)
        self._reference, rejected, setpoints = reference, rejected + refused, self.setpoints
        stamp = answered_stamp(measurement)
        if checked is None:
            setpoints.pause()
            return clipped_command(
                setpoints, stamp, hold_thrusts(self.config, self._gate.inertial), Outcome.HOLD, "hold", rejected
            )
        if self._gate.restarted:
            setpoints.restart()
        setpoints.update(checked, reference, contact)
        free, outcome, mode = analytic_thrusts(setpoints), Outcome.SOLVED, contact_mode(setpoints, reference)
        if not np.isfinite(free).all():
            free, outcome, mode = hold_thrusts(self.config, checked), Outcome.HOLD, "hold"
        return clipped_command(setpoints, stamp, free, outcome, mode, rejected + reach_note(setpoints, reference))
