"""The report: one HTML file with embedded figures."""

from __future__ import annotations

import base64
import platform
from collections.abc import Iterable, Sequence
from html import escape
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from string import Template
from typing import Any

from sim.evaluate.metrics import LINES, false_claims, shown
from sim.flight.pictures import pack_picture
from sim.flight.trace import Trace, law_name
from sim.storage.atomic import write_text
from sim.video.film import still

#: Meaning of every outcome of a control tick.
OUTCOMES = {
    "solved": "The solver reached its accuracy: the normal case.",
    "inaccurate_accepted": "The solver ended with less accuracy, and the result passed the checks.",
    "capped_accepted": "The solver used up its iterations, and the result passed the checks.",
    "exact_fallback": "The solver's result failed the checks; the exact solver answered instead.",
    "analytic_fallback": "No solution passed the checks, now or shortly before; the analytic law controlled this tick.",
    "hold": "Inputs were missing or unusable: the vehicle carried its weight and kept level.",
}
#: Meaning of the limits by the beginning of their names.
LIMITS = {
    "thrust": "A rotor was at its least or greatest thrust, or changed it as fast as it may.",
    "tilt": "The vehicle was kept from leaning further.",
    "yaw": "The vehicle was kept from turning away from the wall.",
    "view": "The vehicle was kept from losing the guide line from the picture.",
    "push_ceiling": "The brush was kept from pushing harder.",
    "approach_speed": "The vehicle was slowed down in front of the wall.",
}


def limit_words(name: str) -> str:
    """Meaning of a limit; empty for one of a user's own."""
    return next((words for start, words in LIMITS.items() if name.startswith(start)), "")


def own_classes(summary: dict[str, Any]) -> str:
    """Classes of the user's that flew, for titles: the law's name then is that of its preset; empty without any."""
    words = {"controller": "control law", "rows": "tasks and limits", "strategy": "strategy"}
    found = ((name, summary.get(key)) for key, name in words.items())
    return "".join(f", {name} {' '.join([own] if isinstance(own, str) else own)}" for name, own in found if own)


_PAGE = Path(__file__).with_name("report_page.html")
#: Packages whose versions can change a flight.
_PACKAGES = ("ibvs-qp", "numpy", "scipy", "casadi", "osqp", "mujoco", "opencv-python-headless", "matplotlib")

#: The picture shown before the video is played, as a fraction of its length [-].
_POSTER = 0.7


def write_report(
    file: Path,
    traces: dict[str, Trace],
    summary: dict[str, Any],
    figures: dict[str, tuple[str, Path]],
    video: Path | None = None,
) -> None:
    """Write report.html.

    Args:
        file: The page.
        traces: Flights, for their events.
        summary: Content of summary.json.
        figures: Caption and PNG file of every figure.
        video: The video in the same folder, or None.
    """
    laws: dict[str, dict[str, Any]] = summary["laws"]
    lead = (
        f"Scene <b>{escape(summary['scene'])}</b>, world <b>{escape(summary['world'])}</b>, seed {summary['seed']}, "
        f"{escape(summary['features'])} features, "
        f"camera {escape(summary['camera'])} {summary['image_size'][0]}×{summary['image_size'][1]}, "
        f"{summary['wall_time_s']:.0f} s on this computer{escape(own_classes(summary))}."
    )
    interrupted = '<p class="warning">Interrupted: this report covers the flight until then.</p>'
    page = Template(_PAGE.read_text(encoding="utf-8")).substitute(
        title="Painting flight: " + " and ".join(map(law_name, laws)) if laws else "No flight",
        lead=lead,
        warning=interrupted if summary["interrupted"] else _false_claims(laws),
        table=_figures_of_merit(laws),
        rows=_rows(laws),
        video=_video(video),
        figures="\n".join(_figure(caption, png) for caption, png in figures.values()),
        events="\n".join(_events(law, trace) for law, trace in traces.items()),
        outcomes=_table(("law", "outcome or limit", "how often", "meaning"), _outcomes(laws), numbers=(2,)),
        command=escape(summary["command"]),
        facts=_table((), _facts(summary)),
    )
    write_text(file, page)


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """HTML table of plain text; ``numbers`` are the indices of the right-aligned columns."""

    def line(tag: str, cells: Sequence[str]) -> str:
        style = (' class="number"' if column in numbers else "" for column in range(len(cells)))
        return "".join(f"<{tag}{each}>{escape(cell)}</{tag}>" for each, cell in zip(style, cells, strict=True))

    lines = [line("th", headings)] if headings else []
    lines += (line("td", row) for row in rows)
    return "<table>" + "".join(f"<tr>{cells}</tr>\n" for cells in lines) + "</table>"


def _figures_of_merit(laws: dict[str, dict[str, Any]]) -> str:
    rows = [(line.words, *(shown(line, figures) for figures in laws.values()), line.unit, line.about) for line in LINES]
    return _table(("", *map(law_name, laws), "unit", "meaning"), rows, range(1, len(laws) + 1))


def _false_claims(laws: dict[str, dict[str, Any]]) -> str:
    """Warnings of flights whose claim and truth differ."""
    return "".join(f'<p class="warning">{escape(line)}.</p>' for line in false_claims(laws))


def _rows(laws: dict[str, dict[str, Any]]) -> str:
    lines = [line for line in LINES if line.in_rows]
    headings = [line.label for line in lines]
    rows = [
        (f"{law_name(law)}, row {row['row']}", *(line.show(row) for line in lines))
        for law, figures in laws.items()
        for row in figures["rows"]
    ]
    return f'<div style="overflow-x:auto">{_table(("", *headings), rows, range(1, len(lines) + 1))}</div>'


def _figure(caption: str, png: Path) -> str:
    data = base64.b64encode(png.read_bytes()).decode("ascii")
    text = escape(caption)
    return f'<figure><img alt="{text}" src="data:image/png;base64,{data}"><figcaption>{text}</figcaption></figure>'


def _video(video: Path | None) -> str:
    if video is None:
        return ""
    name = escape(video.name)
    words = "The vehicle from outside, the view of its camera with the edges found in it, and the push on the board."
    poster = base64.b64encode(pack_picture(still(video, _POSTER)).tobytes()).decode("ascii")
    player = (
        f'<video controls muted loop playsinline preload="metadata" src="{name}" '
        f'poster="data:image/jpeg;base64,{poster}"></video>'
    )
    return f'<figure>{player}<figcaption>{words} File: <a href="{name}">{name}</a></figcaption></figure>'


def _events(law: str, trace: Trace) -> str:
    events = sorted(trace.events, key=lambda event: event.t)
    title = escape(f"{law_name(law)}: {len(events)} events; end of flight: {trace.reason}")
    rows = ((f"{event.t:.2f}", event.kind, event.text) for event in events)
    table = _table(("time [s]", "event", ""), rows, (0,))
    return f"<details open><summary>{title}</summary>{table}</details>"


def _outcomes(laws: dict[str, dict[str, Any]]) -> list[tuple[str, ...]]:
    """Law, outcome or limit, how often, meaning; the most frequent first."""
    rows = []
    for law, figures in laws.items():
        total = max(sum(figures["outcomes"].values()), 1)
        outcomes = {name: (count / total, f"{count} ticks") for name, count in figures["outcomes"].items() if count}
        limits = {name: (part, f"{100 * part:.2f} % of ticks") for name, part in figures["limits"].items() if part}
        for kind, found, words in (("", outcomes, OUTCOMES.get), ("limit ", limits, limit_words)):
            for name, (_, often) in sorted(found.items(), key=lambda each: -each[1][0]):
                rows.append((law_name(law), kind + name.replace("_", " "), often, words(name) or ""))
    return rows


def _facts(summary: dict[str, Any]) -> list[tuple[str, str]]:
    return [
        ("preset", summary["preset"] or "built in"),
        ("vision", summary["vision"]),
        ("peak memory", f"{summary['peak_memory_bytes'] / 2**20:.0f} MiB over all processes"),
        ("Python", platform.python_version()),
        ("system", f"{platform.system()} {platform.machine()}"),
        *((package, _version(package)) for package in _PACKAGES),
    ]


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
