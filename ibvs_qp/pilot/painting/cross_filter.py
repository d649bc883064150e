r"""Kalman filter of the place of the tip across the strokes: states, odometer and correction.

The states: v of the true tip; :math:`\delta`, by which the picture shows the tip at a larger v (camera mount, arm,
attitude); the odometer's drift; the direction of the strokes against the odometer's axes, and how these and the picture
wander with the attitude; :math:`\beta`, by which an edge ahead seems to lie at a larger v than the same edge behind; v
of the board's far edge; and, at `NODES` places along the last stroke and the one being laid, the amount by which the v
of each exceeds that of its map.

A map gets the error that v has when it is laid, so a node takes the error of v until the tip has passed it. Drift and
direction change slowly: they keep a long chain of strokes straight, each of which follows the edge of the one before.
"""

from __future__ import annotations

import math

import numpy as np

#: Standard deviation of a board's edge in one look [m].
BOARD_STD = 1e-3
#: Standard deviation of the tip's place in the picture, by mount and arm [m]; its variance per second, as the attitude
#: wanders by 0.1 deg within minutes [m^2/s].
TIP_STD, TIP_WANDER = 5e-3, 1e-9
#: Standard deviation of beta for each stroke, by the lens [m]; assumed, the roll of the picture is a state.
AHEAD_STD = 4e-4
#: Odometer: variance of v per metre of way and per second at one place [m^2/m], [m^2/s], datasheet world, 1 to 15 s;
#: standard deviation of its drift [m/s], and variance of the drift per second [m^2/s^3].
ODOMETER_PER_M, ODOMETER_AT_REST = 8e-6, 2e-7
DRIFT_STD, DRIFT_WANDER = 1e-3, 1e-9
#: Variance per metre of a stroke without an edge, as nothing shows how the attitude turns the odometer's axes:
#: 1.7e-5 m^2/m in the datasheet world, 2.5e-5 in the harsh one.
UNLED_PER_M = 2.5e-5
#: Standard deviation of the strokes' direction where the board's edge shows it, by the roll of the camera's mount
#: [rad]; its variance per second [rad^2/s].
TURN_STD, TURN_WANDER = 8e-3, 1e-9
#: Wander of the axes of odometer and picture: standard deviation [rad], between 0.25 deg in the datasheet world and
#: 0.4 deg per axis in the harsh one; correlation time [s].
WANDER_STD, WANDER_TIME_S = math.radians(0.3), 8.0
#: Variance of the far edge per metre of way across the strokes: the wall distance that scales it is known to 1 %.
FAR_PER_M = 7e-6
#: Places along a stroke at which the error of its map is a state [-].
NODES = 24

V, TIP, DRIFT, TURN, WANDER, AHEAD, FAR = range(7)
LAST, OWN = slice(7, 7 + NODES), slice(7 + NODES, 7 + 2 * NODES)
STATES = OWN.stop
#: Row of H for the place of an edge at known v, (STATES,).
AT_V = np.where(np.isin(np.arange(STATES), (V, TIP)), -1.0, 0.0)


class CrossFilter:
    """The filter.

    Attributes:
        x, p: States, (STATES,), and their covariance.
    """

    def __init__(self) -> None:
        self.x, self.p = np.zeros(STATES), np.zeros((STATES, STATES))

    @property
    def apparent(self) -> float:
        """Place of the tip as the picture shows it [m]."""
        return float(self.x[V]) + float(self.x[TIP])

    @property
    def turn(self) -> float:
        """Direction of the strokes against the odometer's axis u, from u to v [rad]."""
        return float(self.x[TURN] + self.x[WANDER])

    def start(self, v: float, deviation: float) -> None:
        """Begin at a place from the board's edge [m], with that deviation of its fit [m]: v plus the tip's error."""
        x, p, seen, tip = self.x, self.p, deviation**2 + BOARD_STD**2, TIP_STD**2
        x[:], p[:] = 0.0, 0.0
        x[V] = v
        p[:2, :2] = (seen + tip, -tip), (-tip, tip)
        for state, deviation in ((DRIFT, DRIFT_STD), (TURN, TURN_STD), (WANDER, WANDER_STD)):
            p[state, state] = deviation**2

    def predict(self, du: float, dv: float, dt: float, unled: bool, jumped: bool) -> None:
        """The tip has moved by the odometer, in the axes of the strokes [m], within dt [s].

        ``unled`` is a way without an edge; by a move that ``jumped`` the odometer may be wrong.
        """
        x, p = self.x, self.p
        kept, way = math.exp(-dt / WANDER_TIME_S), math.hypot(du, dv)
        x[V] += dv - x[DRIFT] * dt
        p[V] -= dt * p[DRIFT] + du * (p[TURN] + p[WANDER])
        p[:, V] = p[V]
        p[V, V] -= dt * p[V, DRIFT] + du * (p[V, TURN] + p[V, WANDER])
        x[WANDER] *= kept
        p[WANDER] *= kept
        p[:, WANDER] *= kept
        p[WANDER, WANDER] += (1.0 - kept**2) * WANDER_STD**2
        p[V, V] += (UNLED_PER_M if unled else ODOMETER_PER_M) * way + ODOMETER_AT_REST * dt
        p[DRIFT, DRIFT] += DRIFT_WANDER * dt
        p[TURN, TURN] += TURN_WANDER * dt
        p[TIP, TIP] += TIP_WANDER * dt
        p[FAR, FAR] += FAR_PER_M * abs(dv)
        if jumped:
            p[V, V] += dv**2

    def variance(self, row: np.ndarray) -> float:
        """Variance of the prediction of a row of H."""
        return float(row @ (self.p @ row))

    def correct(self, difference: float, row: np.ndarray, variance: float) -> None:
        """Correct by a difference from the prediction of a row of H; its variance includes that of the noise."""
        gain = self.p @ row / variance
        self.x += gain * difference
        self.p -= np.outer(gain, row @ self.p)

    def find_far_edge(self, place: float, deviation: float) -> None:
        """The board's far edge lies that far from the tip in the picture [m], with that deviation of its fit [m]."""
        x, p = self.x, self.p
        x[FAR] = self.apparent + place
        p[FAR] = -AT_V @ p
        p[:, FAR] = p[FAR]
        p[FAR, FAR] = float(AT_V @ p @ AT_V) + BOARD_STD**2 + deviation**2

    def take_error(self, nodes: np.ndarray) -> None:
        """Those nodes of the stroke that is laid get the error of v."""
        at = OWN.start + np.flatnonzero(nodes)
        self.x[at] = 0.0
        self.p[at] = self.p[V]
        self.p[:, at] = self.p[:, V, np.newaxis]

    def end_stroke(self) -> None:
        """The error of its map becomes that of the last stroke, and beta begins anew."""
        x, p = self.x, self.p
        x[LAST], x[AHEAD] = x[OWN], 0.0
        p[LAST] = p[OWN]
        p[:, LAST] = p[:, OWN]
        p[AHEAD] = p[:, AHEAD] = 0.0
        p[AHEAD, AHEAD] = AHEAD_STD**2
