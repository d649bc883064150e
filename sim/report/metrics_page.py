"""Page of the figures of merit: ``python -m sim.report.metrics_page`` prints docs/metrics.md from the registry."""

from __future__ import annotations

from sim.evaluate import truth
from sim.evaluate.figures import FIGURES, LESS, MATTERS, MORE, REDUCED, Figure
from sim.evaluate.strokes import CORNER_M, END_M
from sim.evaluate.table import markdown

_HEAD = """\
# Figures of merit

Written by `python -m sim.report.metrics_page` from `sim/evaluate/figures.py`; a test compares the page with it.

From the true state of the simulation, per law under `laws` of `summary.json` and per row under `rows`. A figure without
data is `null`. A row includes the climb that leads to it. `summary.json` adds scene, world, seed, preset,
`interrupted`, `wall_time_s` and `peak_memory_bytes` (sum over processes).

**Pattern coordinates.** u runs along the strokes from the board's edge at which stroke 1 begins, v across them from the
edge that guides stroke 1. Strokes are called rows, also where the pattern is columns.

**Reference of the path error.** Row 1 lies `edge_margin_m` from its board edge and ends `edge_margin_m` before the edge
that it runs to. Row k lies one pitch beyond row k − 1 *as painted* (averaged over 1 cm), so an error of row k − 1 is
none of row k. An even row ends where the row before began.
"""

_TRUTH = """
## Completed and claimed

`claimed` is the pilot's report, `completed` is the truth. A flight where they differ is marked in table, report and by
a line on standard error, and it counts as failed in every experiment and sweep.

A paint job is completed if

- every row is *at its place*: its **place error**, the mean over its straight part (without {corner:.0f} cm at both
  ends) of (true tip line − nominal line) when it was first painted, is at most {place:.0f} mm, and its band (the
  cover of the round brush, with the paint of phase `retouch`) touches or overlaps that of the row
  before everywhere but in the last {end:.0f} cm, by at most {most:g} times the nominal overlap. Nominal lines count
  from the board's edge, independent of the rows before, so errors add up;
- every row has its length within {length:.0f} cm, and no hole: no way without contact that is longer than half the
  brush's width and {hole:.0f} cm. Only paint on the board counts;
- the brush touches in {contact:.0f} % of the painting time, {rough:.0f} % with gusts or in the harsh world;
- the tip ends at least {away:.0f} cm from the board, without a crash and without a time-out.

A job without strokes (a press) is completed if it touched, held for its time, slid for its time and at least
{slid:.0f} % of the way, and left the wall, without a crash; after a fault that ended the press, if it landed or
descended for its time.

A strategy of the user's (`paint --strategy`) is completed if the tip moved by every leg that it states
(`Strategy.legs`), in contact in phase `paint`: both components within {length:.0f} cm, nowhere more than {place:.0f} mm
from the mean line of the leg; and contact, retreat and end as of a paint job. Without legs its claim replaces them.
Figures against the scene's strokes are empty.

`push_reduced` names the reason if less than {reduced:.0f} % of the asked push was flown.
The job may still be completed.

## Computed again

`sim.flight.trace_log` writes a flight at the log level `trace`: the inputs of all figures, about 20 kB per second of
flight. `load_trace` reads it back for `sim.evaluate.metrics.compute_metrics`. `ibvs-qp experiment --traces`, or
`traces = true` in a sweep, keeps it for every flight, in the column `trace` of the table.
"""

_LIST = """
## All figures

*Better*: ↓ less, ↑ more. *Matters*: the least difference that counts in comparisons of experiments; a smaller one "does
not matter", however certain it is. Figures after `perception_hz` are those of presses, slides and lost rotors
(`sim/evaluate/measures`).

"""


def metrics_page() -> str:
    """The page in Markdown."""
    limits = {
        "corner": 100.0 * CORNER_M,
        "place": 1e3 * truth.PLACE_M,
        "end": 100.0 * END_M,
        "most": truth.MOST_OVERLAP,
        "length": 100.0 * truth.LENGTH_M,
        "hole": 100.0 * truth.HOLE_M,
        "contact": 100.0 * truth.CONTACT,
        "rough": 100.0 * truth.ROUGH_CONTACT,
        "away": 100.0 * truth.DETACHED_M,
        "slid": 100.0 * truth.SLID,
        "reduced": 100.0 * REDUCED,
    }
    heads = ("figure", "words", "unit", "better", "matters", "meaning")
    why = markdown(("unit", "matters", "because"), [(unit, f"{a:g}", why) for unit, (a, why) in MATTERS.items()])
    own = [(f"`{f.name}`", f"{f.matters[0]:g}", f.matters[1]) for f in FIGURES.values() if f.matters]
    return "".join(
        [
            _HEAD,
            _TRUTH.format(**limits),
            _LIST,
            markdown(heads, map(_line, FIGURES.values())),
            "\nWhy a difference matters, by reported unit:\n\n",
            why,
            "\nFigures with their own:\n\n",
            markdown(("figure", "matters", "because"), own),
        ]
    )


def _line(figure: Figure) -> tuple[str, ...]:
    """A line of the table of all figures."""
    direction = {MORE: "↑", LESS: "↓"}.get(figure.better, "")
    matters = f"{figure.least[0]:g}" if figure.better and (figure.matters or figure.unit in MATTERS) else ""
    return f"`{figure.name}`", figure.words, figure.unit, direction, matters, figure.exactly or figure.about


if __name__ == "__main__":
    print(metrics_page(), end="")
