r"""Vehicle, wall, force feedback and impedance as one linear loop along the wall normal, and its poles.

With x the penetration of the undeformed tip (e_s = -x), f the push and F the rotors' force along the normal:

.. math::
    m \ddot x + c \dot x = F - f, \quad f = k x + b \dot x, \quad
    F(s) = \frac{e^{-s T_h}}{(\tau s + 1)(\tau_u s + 1)} F_c(s),

.. math::
    F_c = -\Big(K + \frac{K_{fi}}{s}\Big) \frac{e^{-s T_f}}{s/\omega_f + 1} f
          - \Big(K_{sp} + K_{sd} s \Big(W + \frac{T s}{\tau_a s + 1}\Big)\Big)\, e^{-s T_h} x - \hat g,
    \quad K = K_{fp} \min(1, k_s / k), \quad
    \hat g = \frac{1}{s/\omega_g + 1} (m \ddot x + e^{-s T_f} f - F).

The impedance damps the rate the lead T ahead, and the push row filters its command with tau_u. The rate itself passes
through
:math:`W = 1 - \frac{\kappa}{s + \kappa} e^{-s T_c}`: with every frame, T_c late, the estimator corrects the speed of a
tip in contact towards zero (`estimation/wall_distance.py`). The observer of gusts (`model/external_wrench.py`) closes
a loop only through the age of the measured force.

T_f is the age of the force in use and T_h half a tick: the mean time from a command to the middle of its hold, and
the mean age of the accelerometer's average over the last tick, from which the rate comes. The lag tau is the mean of
the rising and the falling one, because an oscillation does both. The arm points at the wall through the centre of
mass, so the force needs no moment and m is the whole mass; the reference and the frozen part of the external wrench
are constant. The closed loop's poles are the zeros of

.. math::
    \Delta(s) = m s^2 + (b + c) s + k + \frac{e^{-s T_h}}{(\tau s + 1)(\tau_u s + 1)}
    \Big[\Big(K + \frac{K_{fi}}{s}\Big)
    \frac{e^{-s T_f}(k + b s)}{s/\omega_f + 1}
    + \Big(K_{sp} + K_{sd} s \Big(W + \frac{T s}{\tau_a s + 1}\Big)\Big)\, e^{-s T_h}
    + \frac{(e^{-s T_f} - 1)(k + b s) - c s}{s/\omega_g + 1}\Big].

Pade approximants of the delays give a polynomial whose roots start Newton's method on the exact function. Force
feedback adds stiffness late, which is negative damping and reduces the margin.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial

#: Period of the camera's frames, and their mean age: 60 ms of latency and half a period [s] (design section 5).
FRAME_PERIOD, FRAME_AGE = 1.0 / 30.0, 0.077
#: Order of the Pade approximants; Newton's method removes their error.
PADE_ORDER = 4
#: Faster poles belong to the approximants; rotors with 50 ms of lag cannot excite them [rad/s].
FASTEST_MODE = 250.0
#: Newton's method has diverged beyond this [rad/s].
DIVERGED = 4.0 * FASTEST_MODE
#: Newton's method: relative step at which it stops, largest number of steps, step of the difference quotient [1/s].
POLE_TOLERANCE, NEWTON_STEPS, DIFFERENCE_STEP = 1e-12, 30, 1e-6
#: A last step larger than this, relative to the pole, has found none.
CONVERGED = 1e-9
#: Newton's method may move a start by this fraction; a farther jump leads to another pole, which has its own start.
LARGEST_MOVE = 0.2
#: The polynomial is scaled to this unit of time [s], in which its coefficients are of similar magnitude.
TIME_UNIT = 0.01
#: Roots nearer to zero than this, or to the real axis from below, are rounding [1/TIME_UNIT].
ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True)
class ContactLoop:
    """Numbers of the loop, its characteristic function and its poles; `ibvs_qp.config.contact_margin` derives them.

    Attributes:
        mass: Of the vehicle, m [kg].
        lag: Mean motor lag [s].
        lead: The impedance predicts the rate this far ahead, T [s].
        command_filter: Time constant of the push row's filter, tau_u [s].
        drag: Of the vehicle, c [N s/m].
        stiffness: Of wall and brush together, k [N/m].
        damping: Of wall and brush together, b [N s/m].
        proportional: K, the force gain at this stiffness.
        integral: K_fi [1/s].
        filter_lag: Time constant of the force filter [s].
        spring: Impedance stiffness K_sp [N/m].
        damper: Impedance damping K_sd [N s/m].
        observer: 1 while the observer of gusts learns in contact, else 0.
        gust_bandwidth: Bandwidth of that observer along the normal, omega_g [rad/s].
        force_delay: Mean age of the force in use with half a tick of hold, T_f [s].
        rate_delay: Age of the inertial rate with that hold, T_h [s].
        acceleration_filter: Time constant of the filtered acceleration by which the impedance predicts, tau_a [s].
        acceleration_noise: Noise density of the acceleration along the normal [m/s^2/sqrt(Hz)].
        stationary_speed_std: Standard deviation of the speed of a stationary tip in the estimator [m/s].
    """

    mass: float
    lag: float
    lead: float
    command_filter: float
    drag: float
    stiffness: float
    damping: float
    proportional: float
    integral: float
    filter_lag: float
    spring: float
    damper: float
    observer: float
    gust_bandwidth: float
    force_delay: float
    rate_delay: float
    acceleration_filter: float
    acceleration_noise: float
    stationary_speed_std: float

    @property
    def washout(self) -> float:
        """Bandwidth kappa at which frames pull the speed of a tip in contact to zero [1/s]."""
        return self.acceleration_noise / (self.stationary_speed_std * math.sqrt(FRAME_PERIOD))

    def poles(self) -> list[complex]:
        """Poles below `FASTEST_MODE`, upper half plane and real axis."""
        s = Polynomial([0.0, 1.0])
        force_top, force_bottom = _pade(self.force_delay)
        rate_top, rate_bottom = _pade(self.rate_delay)
        motor, filtered = (self.lag * s + 1.0) * (self.command_filter * s + 1.0), self.filter_lag * s + 1.0
        free = self.mass * s**2 + (self.damping + self.drag) * s + self.stiffness
        force = (self.proportional * s + self.integral) * (self.damping * s + self.stiffness)
        smooth, gust = self.acceleration_filter * s + 1.0, s / self.gust_bandwidth + 1.0
        late_top, late_bottom = _pade(FRAME_AGE)
        high_passed, bottom = (
            (s + self.washout) * late_bottom - self.washout * late_top,
            (s + self.washout) * late_bottom,
        )
        impedance = self.damper * s * (high_passed * smooth + bottom * self.lead * s) + self.spring * smooth * bottom
        unseen = (force_top - force_bottom) * (self.stiffness + self.damping * s) - self.drag * s * force_bottom
        total = free * s * motor * filtered * force_bottom
        total = (total + force * force_top) * rate_bottom * smooth * gust
        total = total + self.observer * unseen * s * filtered * rate_bottom * smooth
        total = total * bottom + impedance * s * filtered * rate_top * force_bottom * gust
        scaled = Polynomial(np.asarray(total.coef, float) / TIME_UNIT ** np.arange(total.coef.size))
        starts = [complex(root) / TIME_UNIT for root in scaled.roots() if root.imag >= -ROUNDING]
        refined = [self._refine(start) for start in starts if ROUNDING < abs(start) < FASTEST_MODE]
        return [pole for pole in refined if pole is not None]

    @property
    def passive_damping_ratio(self) -> float:
        """Damping ratio of vehicle and wall alone, without any feedback."""
        return (self.damping + self.drag) / (2.0 * math.sqrt(self.stiffness * self.mass))

    def characteristic(self, s: complex) -> complex:
        r"""The module's :math:`\Delta(s)`."""
        force = (self.proportional + self.integral / s) * cmath.exp(-s * self.force_delay)
        force *= (self.stiffness + self.damping * s) / (self.filter_lag * s + 1.0)
        ahead = 1.0 - self.washout * cmath.exp(-s * FRAME_AGE) / (s + self.washout)
        ahead += self.lead * s / (self.acceleration_filter * s + 1.0)
        motion = (self.spring + self.damper * s * ahead) * cmath.exp(-s * self.rate_delay)
        unseen = (cmath.exp(-s * self.force_delay) - 1.0) * (self.stiffness + self.damping * s) - self.drag * s
        gust = self.observer * unseen / (s / self.gust_bandwidth + 1.0)
        free = self.mass * s * s + (self.damping + self.drag) * s + self.stiffness
        return free + (force + motion + gust) / ((self.lag * s + 1.0) * (self.command_filter * s + 1.0))

    def _refine(self, start: complex) -> complex | None:
        """Newton's method from an approximate pole; None when it leads elsewhere or nowhere."""
        pole, step, change = start, DIFFERENCE_STEP, start
        for _ in range(NEWTON_STEPS):
            value = self.characteristic(pole)
            slope = (self.characteristic(pole + step) - self.characteristic(pole - step)) / (2.0 * step)
            if slope == 0.0:
                return None
            change = value / slope
            pole -= change
            if abs(pole) > DIVERGED:
                return None
            if abs(change) < POLE_TOLERANCE * abs(pole):
                break
        settled = abs(change) < CONVERGED * abs(pole)
        return pole if settled and abs(pole - start) < LARGEST_MOVE * abs(start) else None


def _pade(delay: float) -> tuple[Polynomial, Polynomial]:
    """Numerator and denominator of the Pade approximant of exp(-s T)."""
    n = PADE_ORDER
    terms = [
        math.factorial(2 * n - j)
        * math.factorial(n)
        / (math.factorial(2 * n) * math.factorial(j))
        / math.factorial(n - j)
        * delay**j
        for j in range(n + 1)
    ]
    return Polynomial([(-1.0) ** j * term for j, term in enumerate(terms)]), Polynomial(terms)
