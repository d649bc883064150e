"""The results page as Markdown, verdict first; all numbers come from the tables."""

from __future__ import annotations

from collections.abc import Sequence

import polars as pl

from sim.experiments.criteria_section import criteria_section
from sim.experiments.impedance_section import impedance_section
from sim.experiments.parts_section import parts_section, rivals_section
from sim.experiments.published_section import published_section, rates_section
from sim.experiments.tables import Section
from sim.experiments.verdict_section import verdict_section
from sim.sweep.statistics import false_claims

#: Experiment whose figure gives the overview.
_OVERVIEW = "worlds"


def _claims(tables: Sequence[pl.DataFrame]) -> str:
    """How many flights were checked by the truth, and how many of them the pilot claims wrongly."""
    checked = sum(table["claimed"].count() for table in tables if "claimed" in table.columns)
    text = ""
    if checked:
        claims = sum(map(false_claims, tables))
        text = f"False claims (claimed by the pilot, not completed by the truth): {claims} of {checked} flights.\n"
    if older := sum(map(len, tables)) - checked:
        text += (
            f"{older} flights are older than the assessment by the truth: they *ended as planned* by the pilot's claim "
            "([experiments](../experiments.md) has them scored again by their figures).\n"
        )
    return text


def results_page(sections: Sequence[Section], lead: str, command: str, name: str) -> str:
    """Markdown text of the page.

    Args:
        sections: The flown experiments.
        lead: A sentence on the flights.
        command: Command that repeats one experiment, with ``{name}`` in the place of its name.
        name: Of the flights: an experiment, or "all".
    """
    flown = [(section.experiment, section.table) for section in sections]
    text = (
        f"# Results of the experiments\n\nGenerated from data by `{command.format(name=name)}`; do not edit. {lead}\n"
        "[tables.md](tables.md) has every table and figure, [experiments.md](../experiments.md) describes the "
        "experiments. All flights are simulated.\n"
    )
    text += _claims([table for _, table in flown])
    if verdict := verdict_section(flown):
        text += "\n## Verdict\n\n" + verdict
    overview = [figure for section in sections if section.experiment.name == _OVERVIEW
                for figure in section.figures.values()]  # fmt: skip
    for caption, file in overview[:1]:
        text += f"\n![{caption}]({file.as_posix()})\n\n*{caption}.*\n"
    chapters = {
        "Cost of weights and of a horizon of one tick": rivals_section(flown),
        "Bounds": criteria_section(flown),
        "Impedance against direct force control": "".join(
            impedance_section(experiment, table) for experiment, table in flown if experiment.name == "force-hold"
        ),
        "Benefit of each part": parts_section(flown),
        "Published flights and rates": "\n".join(filter(None, (published_section(flown), rates_section(flown)))),
    }
    return text + "".join(f"\n## {title}\n\n{chapter}" for title, chapter in chapters.items() if chapter)
