"""The QP against every other law in every cell of the experiment ``fair``; figures that move together count once."""

from __future__ import annotations

from collections.abc import Iterable

import polars as pl

from sim.experiments import FAIR
from sim.experiments.opponent import COMPLETED, Comparison, Outcome, against
from sim.experiments.spec import experiment
from sim.flight.trace import law_name
from sim.sweep.statistics import parameters, split

#: The QP as shipped, and its other gains: no opponent.
OWN = (("qp", "standard"), ("qp", "exchanged-gains"))
#: Figures that move together: a cell counts each group once.
GROUPS = {
    "path": ("path_rms_straight_m", "path_rms_corner_m", "path_rms_m"),
    "push": ("force_rms_straight_n", "force_rms_n", "force_std_n", "push_mean_n"),
    "slide": ("speed_error_share", "stuck_share", "slide_held"),
    "attitude": ("tilt_peak_deg", "yaw_peak_deg"),
    "thrust rate": ("jitter_n_s",),
    "disturbance": ("recovery_s", "fault_path_peak_m", "fault_force_peak_n"),
    "rotor loss": ("survived_s", "push_spike_n"),
    COMPLETED: (COMPLETED,),
}


def opponent_name(law: str, variant: str) -> str:
    """Name of a law with its variant."""
    names = {"mpc": "prediction over 0.3 s", "standard": law_name(law)}
    return names.get(variant, f"{law_name(law)}, {variant}")


def comparisons(table: pl.DataFrame) -> list[Comparison]:
    """Every figure of every cell of the QP against every opponent in it."""
    found, columns = [], experiment(FAIR).columns
    for key, rows in split(table, ("experiment",)):
        flown = {(str(law), str(variant)): part for (law, variant), part in rows.group_by("law", "variant")}
        for opponent in sorted(flown.keys() - set(OWN)):
            name = opponent_name(*opponent)
            found += against(FAIR, parameters(key), name, flown[OWN[0]], flown[opponent], columns)
    return found


def grouped(found: Iterable[Comparison]) -> dict[tuple[str, str, str], frozenset[Outcome]]:
    """Outcomes of every group of figures by opponent, cell and group: better, worse, both, or neither.

    Too few flights that only one law completes are no difference: all seeds of a cell are flown.
    """
    groups: dict[tuple[str, str, str], set[Outcome]] = {}
    for each in found:
        group = next(name for name, metrics in GROUPS.items() if each.metric in metrics)
        few = each.metric == COMPLETED and each.outcome is Outcome.FEW
        outcome = Outcome.NEITHER if few else each.outcome
        groups.setdefault((each.opponent, str(each.params), group), set()).add(outcome)
    return {key: _joint(outcomes) for key, outcomes in groups.items()}


def _joint(outcomes: set[Outcome]) -> frozenset[Outcome]:
    decided = outcomes & {Outcome.WON, Outcome.LOST}
    return frozenset(decided or (outcomes & {Outcome.NEITHER}) or outcomes)
