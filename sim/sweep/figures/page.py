"""The report of a sweep: a page with a table, the reasons of failed flights, and the figures."""

from __future__ import annotations

from pathlib import Path

import polars as pl
from matplotlib.figure import Figure as Canvas

from ibvs_qp.config.errors import ConfigError
from sim.evaluate.figures import Figure
from sim.evaluate.table import markdown
from sim.figures.style import save, styled
from sim.flight.trace import law_name
from sim.storage.atomic import write_text
from sim.sweep.figures.levels import chosen_figures, most_influential, varied
from sim.sweep.figures.maps import draw_boxes, draw_dependence, draw_figure_maps, draw_success_maps
from sim.sweep.parts import HEAD, read_tables

#: Number of parameters in the box plots and in the maps: those with the largest influence.
MOST_BOXES, MOST_MAPS = 4, 3
#: Longest list of reasons of failure.
_REASONS = 8


def read_table(path: Path) -> tuple[pl.DataFrame, Path]:
    """The table of a sweep or an experiment, and the folder of its report.

    Args:
        path: A Parquet file, or a folder with one or with its parts.

    Raises:
        ConfigError: When there is no such table.
    """
    files, folder = [path] if path.is_file() else [], path.parent
    if path.is_dir():
        files, folder = sorted(path.glob("*.parquet")) or sorted((path / "parts").glob("part-*.parquet")), path
    remedy = "give the folder or the Parquet file of `ibvs-qp sweep` or `experiment`"
    if not files:
        raise ConfigError(f"no table in {path}; {remedy}")
    try:
        table = read_tables(files, ("law", "seed", "completed", "reason"), foreign=True)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}; {remedy}") from None
    if not table.height:
        raise ConfigError(f"{path} has no rows yet; fly the sweep first")
    head = [name for name in HEAD if name in table.columns]
    rows = table.unique(subset=pl.selectors.exclude("log"), maintain_order=True)
    return rows.select(*head, pl.exclude(head)), folder


def write_report(table: pl.DataFrame, folder: Path, title: str, chosen: tuple[str, ...] = ()) -> Path:
    """Draw the figures and write ``report.md``; returns its file.

    Args:
        table: Rows of flights.
        folder: Folder of the page and of ``figures/``.
        title: Heading.
        chosen: Figures of merit by column; empty takes the default ones.

    Raises:
        ConfigError: On a figure that the table does not have.
    """
    figures, columns = chosen_figures(table, chosen), varied(table)
    lines = [
        f"# {title}",
        "",
        f"{table.height} flights, {table['version'].drop_nulls().max() or 'version unknown'}.",
        "",
    ]
    lines += [_summary(table, figures), *_reasons(table)]
    with styled():
        for name, (caption, canvas) in _draw_all(table, figures, columns).items():
            save(canvas, folder / "figures" / f"{name}.png")
            lines += [f"## {caption}", "", f"![{caption}](figures/{name}.png)", ""]
    page = folder / "report.md"
    write_text(page, "\n".join(lines).rstrip() + "\n")
    return page


def _draw_all(table: pl.DataFrame, figures: list[Figure], columns: list[str]) -> dict[str, tuple[str, Canvas]]:
    drawn: dict[str, tuple[str, Canvas]] = {}
    if not columns:
        return drawn
    boxed = most_influential(table, figures, columns, MOST_BOXES)
    mapped = most_influential(table, figures, columns, MOST_MAPS)
    which = "" if len(mapped) == len(columns) else f", the {len(mapped)} parameters with the largest influence"
    drawn["success"] = (f"Flights that ended as planned{which}", draw_success_maps(table, mapped))
    for figure in figures:
        drawn[f"boxes-{figure.name}"] = (f"{figure.words.capitalize()}: boxes", draw_boxes(table, figure, boxed))
        drawn[f"map-{figure.name}"] = (
            f"{figure.words.capitalize()}: medians{which}", draw_figure_maps(table, figure, mapped)
        )  # fmt: skip
    if len(columns) > 1 and (canvas := draw_dependence(table, figures, columns)) is not None:
        drawn["dependence"] = ("Rank correlation of parameters and figures", canvas)
    return drawn


def _summary(table: pl.DataFrame, figures: list[Figure]) -> str:
    heads = ["law", "flights", "ended as planned", *(f"{figure.label}: median (5 % to 95 %)" for figure in figures)]
    lines = []
    for law in table["law"].unique(maintain_order=True):
        rows = table.filter(pl.col("law") == law)
        cells = [law_name(law), str(rows.height), f"{100.0 * float(rows['completed'].mean()):.1f} %"]  # type: ignore[arg-type]
        for figure in figures:
            values = figure.scale * rows[figure.name].drop_nulls().drop_nans()
            low, middle, high = (values.quantile(level, "linear") for level in (0.05, 0.5, 0.95))
            cells.append("–" if middle is None else f"{middle:.3g} ({low:.3g} to {high:.3g})")
        lines.append(cells)
    return markdown(heads, lines)


def _reasons(table: pl.DataFrame) -> list[str]:
    failed = table.filter(~pl.col("completed"))
    if not failed.height:
        return []
    counted = failed.group_by("law", "reason").len().sort("len", "law", "reason", descending=[True, False, False])
    rows = [(reason, law_name(law), str(count)) for law, reason, count in counted.head(_REASONS).rows()]
    hidden = counted.height - _REASONS
    rows += [(f"{hidden} further reasons", "", "")] if hidden > 0 else []
    return [markdown(("did not end as planned", "law", "flights"), rows)]
