r"""Thrust to normalised motor command, and back: a quadratic curve that the battery's voltage scales.

.. math:: T = T_{max} \Big(\frac{V}{V_0}\Big)^2 \big(f u^2 + (1 - f) u\big)

with the command u within [0, 1]; f is PX4's THR_MDL_FAC. The voltage counts squared, because a speed controller passes
on a fraction of it and thrust follows the square of the rotor's speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.settings import Checked, setting

#: Smallest quadratic fraction that is inverted as such [-]; below it the curve is a straight line.
LEAST_FACTOR = 1e-6
#: Range of the voltage over the full one [-]: an empty cell of lithium under load, and an overcharged one.
LEAST_VOLTAGE, LARGEST_VOLTAGE = 0.6, 1.1


@dataclass(frozen=True, kw_only=True)
class ThrustCurve(Checked):
    """Curve of a rotor with its motor, speed controller and battery."""

    thrust_max_n: float = setting(52.56, "thrust at full command and full voltage", "N", 0.1, 1000.0, why="Tarot T960")
    quadratic: float = setting(
        1.0, "fraction f of the quadratic part, PX4's THR_MDL_FAC; 0 for a linear speed controller", low=0.0, high=1.0
    )
    full_voltage_v: float = setting(25.2, "voltage at which the thrust was measured", "V", 1.0, 1000.0, why="6 cells")

    def limit(self, voltage: float | None = None) -> float:
        """Thrust at full command [N]: the upper limit to report to the controller as the battery sags.

        Args:
            voltage: Of the battery under load [V]; None or NaN for the full one. A faulty sensor must not stop the
                motors: it is limited to `LEAST_VOLTAGE` to `LARGEST_VOLTAGE`.
        """
        ratio = 1.0 if voltage is None or math.isnan(voltage) else float(voltage) / self.full_voltage_v
        ratio = min(max(ratio, LEAST_VOLTAGE), LARGEST_VOLTAGE)
        return self.thrust_max_n * ratio * ratio

    def commands(self, thrusts: np.ndarray, voltage: float | None = None) -> np.ndarray:
        """Normalised commands for thrusts, within [0, 1].

        Args:
            thrusts: Thrusts [N], any shape; those beyond the limit get full command, NaN gets none.
            voltage: Of the battery under load [V]; None for the full one.
        """
        limit, factor = self.limit(voltage), self.quadratic
        ratio = np.clip(np.nan_to_num(np.asarray(thrusts, float), nan=0.0) / limit, 0.0, 1.0)
        if factor < LEAST_FACTOR:
            return ratio
        linear = 1.0 - factor
        root = np.sqrt(linear * linear + 4.0 * factor * ratio)
        return np.minimum((root - linear) / (2.0 * factor), 1.0)  # rounding: 1 + 1e-11 for a small factor

    def thrusts(self, commands: np.ndarray, voltage: float | None = None) -> np.ndarray:
        """Thrusts of normalised commands [N].

        Args:
            commands: Within [0, 1], any shape.
            voltage: Of the battery under load [V]; None for the full one.
        """
        u = np.asarray(commands, float)
        return self.limit(voltage) * (self.quadratic * u * u + (1.0 - self.quadratic) * u)
