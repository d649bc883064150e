"""The report: one HTML file that needs nothing else, figures embedded."""

from __future__ import annotations

import base64
import platform
from html import escape
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from string import Template
from typing import Any

from sim.evaluate.table import LAW_HEADINGS, LINES
from sim.flight.trace import Trace

_PAGE = Path(__file__).with_name("report_page.html")
#: Packages whose versions decide what a flight does.
_PACKAGES = ("ibvs-qp", "numpy", "scipy", "casadi", "osqp", "mujoco", "opencv-python-headless", "matplotlib")
_ROW_KEYS = (
    "stroke_m", "coverage", "path_rms_straight_m", "path_rms_corner_m", "path_max_m", "force_rms_straight_n",
    "force_rms_corner_n", "contact_share", "tilt_peak_deg", "yaw_peak_deg",
)  # fmt: skip


def write_report(
    file: Path,
    traces: dict[str, Trace],
    summary: dict[str, Any],
    figures: dict[str, tuple[str, Path]],
    video: Path | None = None,
) -> None:
    """Write report.html.

    Args:
        file: Where.
        traces: Flights, for their events.
        summary: Content of summary.json.
        figures: Caption and PNG file of every figure.
        video: The video beside the report, if there is one.
    """
    laws: dict[str, dict[str, Any]] = summary["laws"]
    names = [LAW_HEADINGS.get(law, law) for law in laws]
    lead = (
        f"Scene <b>{escape(summary['scene'])}</b>, seed {summary['seed']}, {escape(summary['features'])} features, "
        f"camera {escape(summary['camera'])} {summary['image_size'][0]}×{summary['image_size'][1]}, "
        f"{summary['wall_time_s']:.0f} s on this computer."
    )
    interrupted = '<p class="warning">Interrupted: this is what was flown until then.</p>'
    page = Template(_PAGE.read_text(encoding="utf-8")).substitute(
        title="Flying and painting: " + " and ".join(names) if names else "Nothing was flown",
        lead=lead,
        warning=interrupted if summary["interrupted"] else "",
        table=_figures_of_merit(laws),
        rows=_rows(laws),
        video=_video(video),
        figures="\n".join(_figure(caption, png) for caption, png in figures.values()),
        events="\n".join(_events(law, trace) for law, trace in traces.items()),
        outcomes=_outcomes(laws),
        command=escape(summary["command"]),
        facts=_facts(summary),
    )
    file.write_text(page, encoding="utf-8")


def _figures_of_merit(laws: dict[str, dict[str, Any]]) -> str:
    head = "".join(f'<th class="number {escape(law)}">{escape(LAW_HEADINGS.get(law, law))}</th>' for law in laws)
    body = "".join(
        f"<tr><td>{escape(line.label)}</td>"
        + "".join(f'<td class="number">{escape(line.show(figures))}</td>' for figures in laws.values())
        + f'<td class="unit">{escape(line.unit)}</td></tr>\n'
        for line in LINES
    )
    return f"<table><tr><th></th>{head}<th></th></tr>\n{body}</table>"


def _rows(laws: dict[str, dict[str, Any]]) -> str:
    lines = [line for key in _ROW_KEYS for line in LINES if line.key == key]
    head = "".join(
        f'<th class="number">{escape(line.label)}{f" [{escape(line.unit)}]" if line.unit else ""}</th>'
        for line in lines
    )
    body = ""
    for law, figures in laws.items():
        for row in figures["rows"]:
            cells = "".join(f'<td class="number">{escape(line.show(row))}</td>' for line in lines)
            body += f"<tr><td>{escape(LAW_HEADINGS.get(law, law))}, row {row['row']}</td>{cells}</tr>\n"
    return f'<div style="overflow-x:auto"><table><tr><th></th>{head}</tr>\n{body}</table></div>'


def _figure(caption: str, png: Path) -> str:
    data = base64.b64encode(png.read_bytes()).decode("ascii")
    text = escape(caption)
    return f'<figure><img alt="{text}" src="data:image/png;base64,{data}"><figcaption>{text}</figcaption></figure>'


def _video(video: Path | None) -> str:
    if video is None:
        return ""
    name = escape(video.name)
    return f'<h2>Video</h2><p><a href="{name}">{name}</a> lies beside this report: camera view, phase and push.</p>'


def _events(law: str, trace: Trace) -> str:
    lines = "".join(
        f'<tr><td class="number">{event.t:.2f}</td><td>{escape(event.kind)}</td><td>{escape(event.text)}</td></tr>\n'
        for event in sorted(trace.events, key=lambda event: event.t)
    )
    title = f"{escape(LAW_HEADINGS.get(law, law))}: {len(trace.events)} events; ended: {escape(trace.reason)}"
    head = '<tr><th class="number">time [s]</th><th>event</th><th></th></tr>'
    return f"<details open><summary>{title}</summary><table>{head}\n{lines}</table></details>"


def _outcomes(laws: dict[str, dict[str, Any]]) -> str:
    body = ""
    for law, figures in laws.items():
        name = escape(LAW_HEADINGS.get(law, law))
        for outcome, ticks in figures["outcomes"].items():
            if ticks:
                body += (
                    f'<tr><td>{name}</td><td>outcome {escape(outcome)}</td><td class="number">{ticks} ticks</td></tr>\n'
                )
        for limit, share in figures["limits"].items():
            if share and share > 0:
                body += (
                    f"<tr><td>{name}</td><td>limit {escape(limit)} active</td>"
                    f'<td class="number">{100 * share:.2f} %</td></tr>\n'
                )
    return f"<table>{body}</table>"


def _facts(summary: dict[str, Any]) -> str:
    facts = {
        "preset": summary["preset"] or "built in",
        "vision": summary["vision"],
        "peak memory": f"{summary['peak_memory_bytes'] / 2**20:.0f} MiB over all processes",
        "Python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        **{package: _version(package) for package in _PACKAGES},
    }
    body = "".join(f"<tr><td>{escape(key)}</td><td>{escape(str(value))}</td></tr>\n" for key, value in facts.items())
    return f"<table>{body}</table>"


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
