r"""Contact of the brush tip with the board: a linear spring and damper with Coulomb friction, in MuJoCo's terms.

MuJoCo's contact row obeys :math:`f = (a_{ref} - a) / R` with :math:`R = (1 - d) / (d \hat m)`, impedance d and the
body's :math:`\hat m` = 1 / ``body_invweight0``. With the direct format ``solref = (-k, -b)`` this is a spring of
:math:`K = k \hat m / (1 - d)`, a damper of :math:`b \hat m / (1 - d)` and an apparent mass of
:math:`d \hat m / (1 - d)`. The regularised friction cone also adds :math:`\mu r v\, d \hat m / (1 - d)` to the normal
force of a tip that slides at speed v, r being the rate of the friction rows; settings for which this comes near the
push make a sliding tip chatter. A small d makes both terms vanish: the contact is then the specified spring and damper,
and the no-slip pass, which works without regularisation, alone decides the friction.
"""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import mujoco

#: Constraint impedance d [-]: apparent mass 0.2 % of the body's, friction lift below 0.1 N at 0.2 m/s and mu 0.8.
IMPEDANCE = 0.002

#: Rate at which a sticking tip loses its slip velocity [1/s]; a Coulomb contact stops within 10 ms.
STICK_RATE = 100.0

#: Solver options under which the recipe holds. The no-slip pass removes the creep of a sticking tip. No force here is
#: implicit in the velocity and there is one contact, so Euler steps without a search for islands cost a seventh less;
#: constraint types that the model lacks are disabled.
OPTION_XML = (
    '<option timestep="0.001" gravity="{gravity}" integrator="Euler" cone="elliptic" impratio="10" '
    'solver="Newton" jacobian="dense" noslip_iterations="3"><flag autoreset="disable" island="disable" '
    'equality="disable" frictionloss="disable" limit="disable" spring="disable" damper="disable" clampctrl="disable" '
    'eulerdamp="disable"/></option>'
)


#: Name of the contact pair.
_PAIR = "brush"


def pair_xml(tip: str, board: str) -> str:
    """The explicit contact pair of two named geoms; `set_contact` gives it its numbers."""
    return f'<contact><pair name="{_PAIR}" geom1="{tip}" geom2="{board}" condim="3"/></contact>'


def set_contact(model: mujoco.MjModel, *, stiffness: float, damping: float, friction: float) -> None:
    """Give a compiled model's contact pair the specified physical stiffness, damping and friction.

    Args:
        model: Compiled model with the pair of `pair_xml`; its masses must be final.
        stiffness: Contact stiffness K [N/m].
        damping: Contact damping [N s/m].
        friction: Coulomb coefficient mu [-].
    """
    pair, scale = _pair(model)
    model.pair_solref[pair] = (-stiffness * scale, -damping * scale)
    # Friction rows have no position error, so only their damping acts; MuJoCo divides it by the impedance.
    model.pair_solreffriction[pair] = (-STICK_RATE * IMPEDANCE, -STICK_RATE * IMPEDANCE)
    model.pair_solimp[pair] = (IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0)
    model.pair_friction[pair] = (friction, friction, 0.0, 0.0, 0.0)
    model.pair_margin[pair] = model.pair_gap[pair] = 0.0


def set_stiffness(model: mujoco.MjModel, stiffness: float) -> None:
    """Change the stiffness of a model's contact pair [N/m]."""
    pair, scale = _pair(model)
    model.pair_solref[pair, 0] = -stiffness * scale


def set_friction(model: mujoco.MjModel, friction: float) -> None:
    """Change the Coulomb coefficient of a model's contact pair."""
    pair, _ = _pair(model)
    model.pair_friction[pair, :2] = friction


def contact_stiffness(model: mujoco.MjModel) -> float:
    """Stiffness K of a model's contact pair [N/m]."""
    pair, scale = _pair(model)
    return -float(model.pair_solref[pair, 0]) / scale


def _pair(model: mujoco.MjModel) -> tuple[int, float]:
    """Index of the contact pair, and MuJoCo's numbers over physical stiffness and damping [1/kg]."""
    pair = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_PAIR, _PAIR)
    bodies = model.geom_bodyid[[model.pair_geom1[pair], model.pair_geom2[pair]]]
    return pair, (1.0 - IMPEDANCE) * float(model.body_invweight0[bodies, 0].sum())
