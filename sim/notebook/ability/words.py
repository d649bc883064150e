"""Abilities of vehicles as markdown tables."""

from __future__ import annotations

import math

from allocation import TAROT_T960
from sim.notebook.ability.abilities import Abilities, abilities, kept_after_loss
from sim.notebook.ability.case import VehicleCase, vehicle_case
from sim.notebook.ability.choice import Duties


def _number(value: float, digits: int = 1) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "impossible"


def abilities_table(ours: Abilities, nominal: Abilities) -> str:
    """Two vehicles side by side."""
    rows = [("hover thrust of full thrust [%]", 100.0 * ours.hover_share, 100.0 * nominal.hover_share)]
    rows += [("ideal hover power [W]", ours.hover_power_w, nominal.hover_power_w)]
    rows += [("greatest push, standing still [N]", ours.push_still_n, nominal.push_still_n)]
    rows += [("least push that can be held [N]", ours.push_least_n, nominal.push_least_n)]
    for way, push in ours.push_sliding_n.items():
        rows.append((f"greatest push, sliding {way} [N]", push, nominal.push_sliding_n[way]))
    rows += [("greatest push, any travel [N]", ours.push_any_n, nominal.push_any_n)]
    rows += [("horizontal force in every direction [N]", ours.lateral_worst_n, nominal.lateral_worst_n)]
    lines = ["| | this vehicle | as shipped |", "|---|---:|---:|"]
    lines += [f"| {words} | {_number(here)} | {_number(there)} |" for words, here, there in rows]
    ends = ", ".join(ours.binding).replace("_", " ") or "–"
    return "\n".join([*lines, "", f"What ends the push standing still: {ends}."])


def choice_text(chosen: VehicleCase | None, nominal: VehicleCase, duties: Duties) -> str:
    """The chosen design beside the shipped one, or that there is none."""
    if chosen is None:
        return "**No design on this map meets every duty.**"
    head = f"**Cheapest: {chosen.vehicle.geometry.tilt_deg:g}° at {chosen.vehicle.mass_kg:g} kg.**\n\n"
    return head + abilities_table(abilities(chosen, duties.friction), abilities(nominal, duties.friction))


def loss_table(mass_kg: float, tilt_deg: float) -> str:
    """What must be let go after the loss of each rotor, with the idle floor and with rotors that may stop."""
    lines = [
        "| lost rotor | idle floor | sideways force [N] | as a lean [deg] | or yaw moment [N m] |",
        "|---|---|---:|---:|---:|",
    ]
    for words, idle in (("as it is", True), ("none", False)):
        for name in TAROT_T960.names:
            case = vehicle_case(mass_kg=mass_kg, tilt_deg=tilt_deg, weak_rotor=name, share=0.0)
            kept = kept_after_loss(case if idle else case.without_idle_floor())
            values = " | ".join(_number(kept[key]) for key in ("lateral_n", "lean_deg", "yaw_nm"))
            lines.append(f"| {name.replace('_', ' ')} | {words} | {values} |")
    return "\n".join(lines)
