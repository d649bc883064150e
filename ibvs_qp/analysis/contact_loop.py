r"""Vehicle, wall, Kalman filter of the push and force law as one linear loop along the wall normal.

With x the penetration of the undeformed tip, f the push and F the rotors' force along the normal:

.. math::
    m \ddot x + c \dot x = F - f, \quad f = k x + b \dot x, \quad \tau \dot F = F_c - F.

In every tick the filter (`ibvs_qp.estimation.push_disturbance`) has a force sample of age T_f and the accelerometer,
at the gain of its stationary covariance, and with its forces d, e the law (`ibvs_qp.tasks.push`) commands

.. math::
    F_c = t + k_u (F_c^{last} + d + e - t) - d - e, \quad
    t = -K f - K_{sd} (v + T \dot v) - K_{fi} \textstyle\int f, \quad K = K_{fp} \min(1, k_s / k) + K_{sp} / k.

The command holds until the next tick, so the loop is a difference equation; its poles are those of its transition
matrix. The lag tau is the mean of the rising and the falling one, because an oscillation does both. The arm points at
the wall through the centre of mass, so the force needs no moment and m is the whole mass.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

#: Faster poles than this part of the tick rate are those of delays [-]; so is a pole at zero.
FASTEST, DEAD = 0.5, 1e-6
#: Frequencies at which the sensitivity is evaluated [rad/s].
FREQUENCIES = np.geomspace(0.1, 700.0, 600)


@dataclass(frozen=True, kw_only=True)
class ContactLoop:
    """Numbers of the loop, its transition and its poles; `ibvs_qp.config.contact_margin` derives them.

    Attributes:
        mass: Of the vehicle, m [kg].
        lag: Mean motor lag [s].
        tick: Of the controller [s].
        lead: The impedance predicts the rate this far ahead, T [s].
        command_filter: Time constant of the push row's filter [s].
        drag: Of the vehicle, c [N s/m].
        stiffness: Of wall and brush together, k [N/m]; believed: that of filter and law.
        damping: Of wall and brush together, b [N s/m]; believed_damping: that of the filter.
        proportional: K at the believed stiffness.
        integral: K_fi [1/s].
        damper: Impedance damping K_sd [N s/m].
        noise: Process noise densities of the filter, (4,).
        force_delay: Mean age of the force in use, T_f [s]; believed_delay: that of the filter.
        push_density: Of the force sensor's noise [N^2/Hz].
        vibration: Standard deviation of a sample of the accelerometer [m/s^2].
    """

    mass: float
    lag: float
    tick: float
    lead: float
    command_filter: float
    drag: float
    stiffness: float
    believed: float
    damping: float
    believed_damping: float
    proportional: float
    integral: float
    damper: float
    noise: tuple[float, ...]
    force_delay: float
    believed_delay: float
    push_density: float
    vibration: float

    def poles(self) -> list[complex]:
        """Poles of the closed loop, upper half plane and real axis [1/s]."""
        matrix, command, row = self._open()
        steps = np.linalg.eigvals(matrix + np.outer(command, row))
        poles = [complex(np.log(step)) / self.tick for step in steps if abs(step) > DEAD]
        fastest = FASTEST * 2.0 * math.pi / self.tick
        return [pole for pole in poles if 0.0 <= pole.imag < fastest and abs(pole) < fastest]

    @property
    def sensitivity(self) -> float:
        """Largest sensitivity M_s of the loop, cut at the rotors' command [-]."""
        matrix, command, row = self._open()
        shift = np.exp(1j * FREQUENCIES[FREQUENCIES < math.pi / self.tick] * self.tick)
        inverse = np.linalg.solve(shift[:, None, None] * np.eye(len(matrix)) - matrix, command[:, None])
        return float(np.max(1.0 / np.abs(1.0 - inverse[:, :, 0] @ row)))

    @property
    def passive_damping_ratio(self) -> float:
        """Damping ratio of vehicle and wall alone, without any feedback."""
        return (self.damping + self.drag) / (2.0 * math.sqrt(self.stiffness * self.mass))

    def _open(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Loop cut at the rotors: transition of a tick, effect of the rotors' command, and the law's command."""
        history = math.ceil(self.force_delay / self.tick) + 1
        size = 10 + history
        columns = np.eye(size + 1)
        following, commanded = self._step(columns[:size], columns[size])
        return following[:, :size], following[:, size], commanded[:size]

    def _step(self, state: np.ndarray, rotors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """One tick, linear in the rows of the state and in the rotors' command: the next state, and the law's command.

        Rows of the state: penetration, speed, rotors' force; that force by the model; elastic push, rate, d, e of the
        filter; integral; last command; past pushes, the newest first.
        """
        x, v, force, modelled, *estimate, integral, last = state[:10]
        push = self.stiffness * x + self.damping * v
        pushes = np.vstack((push, state[10:]))
        whole, part = divmod(self.force_delay / self.tick, 1.0)
        sample = (1.0 - part) * pushes[int(whole)] + part * pushes[int(whole) + 1]
        inertial = force - push - self.drag * v - modelled

        transition, rows, gain = self._filter()
        given = self.tick / self.mass * modelled
        predicted = transition @ np.array(estimate)
        predicted[:2] += self.believed * self.tick * given, given
        estimate = predicted + gain @ (np.vstack((sample, inertial)) - rows @ predicted)
        felt = estimate[0] + self.believed_damping * estimate[1]
        rate, external = estimate[1], estimate[2] + estimate[3]
        acceleration = (modelled + external - felt) / self.mass
        integral = integral + self.tick * felt
        target = -self.proportional * felt - self.damper * (rate + self.lead * acceleration) - self.integral * integral
        share = math.exp(-self.tick / self.command_filter) if self.command_filter > 0.0 else 0.0
        command = target + share * (last + external - target) - external

        follow = 1.0 - math.exp(-self.tick / self.lag)
        plant = self._plant() @ np.vstack((x, v, force, rotors))
        motor = modelled + follow * (command - modelled)
        return np.vstack((plant[:3], motor, estimate, integral, command, pushes[:-1])), command

    def _plant(self) -> np.ndarray:
        """Transition of penetration, speed and force over a tick at a constant command, (4, 4)."""
        from scipy.linalg import expm

        rate = np.zeros((4, 4))
        rate[0, 1] = 1.0
        rate[1, :3] = -self.stiffness / self.mass, -(self.damping + self.drag) / self.mass, 1.0 / self.mass
        rate[2, 2], rate[2, 3] = -1.0 / self.lag, 1.0 / self.lag
        return expm(self.tick * rate)

    def _filter(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Transition, measurement rows and stationary gain of the Kalman filter."""
        from scipy.linalg import solve_discrete_are

        step, damping = self.tick / self.mass, self.believed_damping
        transition = np.eye(4)
        transition[1] = -step, 1.0 - step * damping, step, step
        transition[0] += self.believed * self.tick * transition[1]
        rows = np.array([[1.0, damping - self.believed_delay * self.believed, 0, 0], [-1.0, -damping, 1.0, 0]])
        measured = np.diag([self.push_density / self.tick, (self.mass * self.vibration) ** 2])
        covariance = solve_discrete_are(transition.T, rows.T, self.tick * np.diag(self.noise), measured)
        gain = np.linalg.solve(rows @ covariance @ rows.T + measured, rows @ covariance).T
        return transition, rows, gain
