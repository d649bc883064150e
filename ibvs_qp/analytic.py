"""PaperController: the published analytic law, corrected, behind the same interface; baseline and fallback."""

from __future__ import annotations

import functools

import numpy as np

from allocation import allocate_least_squares, allocate_sequential
from ibvs_qp.checked_law import CheckedLaw
from ibvs_qp.command import Command, Outcome
from ibvs_qp.config import ControllerConfig
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.model.inputs import equations
from ibvs_qp.model.interaction_matrix import endpoint_line_row
from ibvs_qp.model.model import Model
from ibvs_qp.model.reporting import clip, clipped_command, reach_note
from ibvs_qp.model.setpoints import LineSetpoint, Setpoints
from ibvs_qp.tasks import LevelTask, LineTask, PushTask, StandoffTask, VelocityTask, YawTask

#: Singular values below this fraction of the largest are dropped in the pseudo-inverse of L.
RANK_TOLERANCE = 0.05


def analytic_wrench(setpoints: Setpoints) -> np.ndarray:
    r"""Control wrench tau of the paper, equations 4 to 16 as corrected in the design, section 3.

    .. math::
        \tau = (I-\Lambda)\,\tau_{vs} + \Lambda \tau_f, \quad
        \tau_{vs} = M [L^\dagger \ddot s + (I - L^\dagger L) a_p], \quad
        \ddot s = -(K_p e + K_d (\dot e + T L \dot\nu_{now}) + K_i \textstyle\int e), \quad
        \Lambda = \mathrm{blockdiag}(\lambda n n^T, 0)

    with the acceleration a_p of the secondary tasks and the push n F as tau_f.

    Returns:
        Wrench beyond feedback linearisation [N, N m], (6,).
    """
    acceleration = _secondary_acceleration(setpoints)
    if lines := setpoints.lines:
        matrix, image_acceleration = _stacked_lines(lines, setpoints.config)
        inverse = _pseudo_inverse(matrix)
        acceleration = inverse.dot(image_acceleration) + acceleration - inverse.dot(matrix.dot(acceleration))
    wrench = setpoints.mass_matrix @ acceleration
    # The push accelerates the tip, which a leaning wall moves along n by a turn of the body, too.
    along = float(setpoints.normal.dot(wrench[:3]) + setpoints.turning_lever.dot(acceleration[3:]))
    wrench[:3] += setpoints.normal * setpoints.contact_weight * (setpoints.push_command - along)
    return wrench


def _secondary_acceleration(setpoints: Setpoints) -> np.ndarray:
    """Acceleration a_p of stand-off, velocity and attitude, for the null space of the lines, (6,).

    The stand-off has the weight 1 - lambda, as in the program. At full weight in contact the projector would turn it
    into an acceleration along the wall, a standing height error of 1.2 mm.
    """
    free = 1.0 - setpoints.contact_weight
    standoff = free * setpoints.standoff_command / setpoints.config.vehicle.mass_kg
    right, down = setpoints.velocity_command.tolist()
    axes = zip(setpoints.normal.tolist(), setpoints.right.tolist(), setpoints.down.tolist(), strict=True)
    return np.array([n * standoff + r * right + d * down for n, r, d in axes] + setpoints.angular.tolist())


def _stacked_lines(lines: list[LineSetpoint], config: ControllerConfig) -> tuple[np.ndarray, np.ndarray]:
    """L and the commanded image acceleration: every line, and with `analytic_angle_row` the angle of the central one.

    Stacking the angle rows of a horizontal and a vertical line as printed makes their difference command pitch through
    a lever of rho: measured, a vertical edge entering the image pitched the vehicle by 14 degrees.
    """
    at_tip = config.analytic_line_point == "tip"
    rows = [endpoint_line_row(line.matrix, line.theta, line.tip) if at_tip else line.matrix[0] for line in lines]
    commands = [line.analytic_command for line in lines]
    if config.analytic_angle_row:
        level = min(lines, key=lambda line: abs(line.rho))
        rows.append(level.matrix[1])
        commands.append(level.angle_command)
    return np.array(rows), np.array(commands)


def _pseudo_inverse(matrix: np.ndarray) -> np.ndarray:
    """Bit-identical to `numpy.linalg.pinv` of a small matrix, without its handling of stacks: half the time."""
    left, singular, right = np.linalg.svd(matrix, full_matrices=False)
    values = singular.tolist()  # the largest first
    least = RANK_TOLERANCE * values[0]
    inverted = np.array([[1.0 / value if value > least else 0.0] for value in values])
    return np.matmul(right.T, inverted * left.T)


def analytic_thrusts(setpoints: Setpoints) -> np.ndarray:
    """Unclipped thrusts of the analytic law: feedback linearisation and pseudo-inverse allocation [N], (n,)."""
    return setpoints.inverse.dot(analytic_wrench(setpoints) - setpoints.bias_wrench)


def allocate(setpoints: Setpoints, free: np.ndarray, allocator: str = "") -> np.ndarray:
    """Thrusts within this tick's window [N], (n,).

    Args:
        setpoints: Set-points of the tick, with the window.
        free: Thrusts of the desired wrench without limits [N], (n,), finite.
        allocator: "clip", "sequential" or "box"; the configured one if empty.
    """
    allocator, clipped = allocator or setpoints.config.allocator, clip(setpoints, free)
    if allocator == "clip" or np.array_equal(clipped, free):
        return clipped
    matrix = setpoints.effectiveness
    function = allocate_sequential if allocator == "sequential" else allocate_least_squares
    return function(matrix.dot(free), matrix, setpoints.lower, setpoints.upper)


def allocate_in_box(setpoints: Setpoints, free: np.ndarray) -> np.ndarray:
    """Thrusts within this tick's window whose wrench is nearest [N], (n,): the allocator of the program's fallback."""
    return allocate(setpoints, free, "box")


def analytic_setpoints(config: ControllerConfig) -> Setpoints:
    """Targets of the tasks without a program: the analytic law combines them itself."""
    return Setpoints(_analytic_model(equations(config)).of(config))


@functools.lru_cache(maxsize=8)
def _analytic_model(config: ControllerConfig) -> Model:
    model = Model(config)
    lines = [LineTask(index) for index in range(config.line_slots)]
    for task in (*lines, PushTask(), StandoffTask(), LevelTask(), YawTask(), VelocityTask()):
        task.rows(model)
    return model


class PaperController(CheckedLaw):
    """The paper's law with the same measurement, reference and command as the program.

    A law of your own is a subclass with another `thrusts`; checks of inputs, estimates, set-points and limits stay.
    """

    def __init__(self, config: ControllerConfig | None = None) -> None:
        super().__init__(config or ControllerConfig())
        self.setpoints = self._make_setpoints()
        self.reset()

    def _make_setpoints(self) -> Setpoints:
        return analytic_setpoints(self.config)

    def thrusts(self, measurement: Measurement, reference: Reference) -> np.ndarray:
        """Thrusts of a tick before the thrust limits [N], (n,): the allocator brings them into the tick's window.

        Args:
            measurement: Checked measurement.
            reference: Checked reference.
        """
        return analytic_thrusts(self.setpoints)

    def _command(self, measurement: Measurement, reference: Reference, rejected: tuple[str, ...]) -> Command:
        rejected += reach_note(self.setpoints, reference)
        free = self.thrusts(measurement, reference)
        return clipped_command(self.setpoints, measurement, reference, free, Outcome.SOLVED, rejected, allocate)
