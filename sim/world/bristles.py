r"""The brush as bristles: stiffer with depth, hysteretic, sticking harder than sliding, and dragged by paint.

At every physics step the contact's numbers follow its state. The stiffness is

.. math:: K (1 + p\, x / 1\,\mathrm{mm}) (1 \pm h)

for the penetration x, + while it grows; the coefficient of friction falls from its static value to that of the scene
at slip speeds beyond :math:`v_s`; a wet brush adds a drag c along the wall, which falls as it dries.
"""

from __future__ import annotations

import math

from sim.world.errors import BrushErrors

#: Slip speed at which friction has fallen by 1/e from static to sliding [m/s] (Stribeck; assumed).
STRIBECK_M_S = 0.005
#: Rate of penetration over which the branch of the hysteresis changes [m/s]: no jump of the force at rest.
TURN_M_S = 0.002
_MM = 1e-3


class Bristles:
    """Contact numbers of a brush from its motion.

    Args:
        errors: Sizes.
        stiffness: Of the first touch [N/m].
        friction: Sliding coefficient.
    """

    def __init__(self, errors: BrushErrors, stiffness: float, friction: float) -> None:
        self._errors, self._stiffness, self._friction = errors, stiffness, friction

    def set_wall(self, stiffness: float, friction: float) -> None:
        """Another stiffness of the first touch [N/m] and sliding coefficient."""
        self._stiffness, self._friction = stiffness, friction

    def depth(self, force: float) -> float:
        """Penetration of a brush at rest [m] under a force [N]: :math:`K x (1 + p x) = F`."""
        spring, growth = force / self._stiffness, self._errors.progression_per_mm / _MM
        return 2.0 * spring / (1.0 + math.sqrt(1.0 + 4.0 * growth * spring))

    def stiffness(self, depth: float, rate: float) -> float:
        """Stiffness [N/m].

        Args:
            depth: Penetration [m].
            rate: Its rate [m/s].
        """
        errors = self._errors
        progressive = 1.0 + errors.progression_per_mm * max(depth, 0.0) / _MM
        return self._stiffness * progressive * (1.0 + errors.hysteresis * math.tanh(rate / TURN_M_S))

    def friction(self, slip: float) -> float:
        """Coefficient of friction at a slip speed [m/s]."""
        extra = self._errors.static_friction * math.exp(-((slip / STRIBECK_M_S) ** 2))
        return self._friction * (1.0 + extra)

    def drag(self, wet_s: float) -> float:
        """Viscous drag along the wall [N s/m] after a time on the wall [s]."""
        return self._errors.drag_n_s_m * math.exp(-wet_s / self._errors.drying_s) if self._errors.drag_n_s_m else 0.0
