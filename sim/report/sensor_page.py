"""Table of the sensor frame in docs/sensors.md, from its channels and its docstring.

``python -m sim.report.sensor_page docs/sensors.md`` renews it; a test compares the page with the channels.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import re
import sys
from pathlib import Path

from ibvs_qp.measurement import Channel, SensorFrame, channels
from ibvs_qp.validation.fields import UNIT_TOLERANCE
from sim.evaluate.table import markdown

#: Marks around the table.
BEGIN, END = "<!-- channels: generated -->", "<!-- end of channels -->"
#: An attribute in a docstring: name, and text to the next one.
_ATTRIBUTE = re.compile(r"^    (\w+): (.*(?:\n {8}.*)*)", re.MULTILINE)
#: Unit and shape in such a text, which have a column.
_FORM = re.compile(r" \[[^\]]+\]|, \(\d+,\)")


def frame_table() -> str:
    """Markdown table of all fields of a sensor frame."""
    texts = {name: " ".join(text.split()) for name, text in _ATTRIBUTE.findall(inspect.getdoc(SensorFrame) or "")}
    rows = []
    for field in dataclasses.fields(SensorFrame):
        each = channels(SensorFrame).get(field.name, Channel())
        text = _FORM.sub("", texts[field.name]).removesuffix(".")
        rows.append([f"`{field.name}`", _type(each, str(field.type)), text, _bounds(each), *_times(each)])
    return markdown(("Field", "Type", "Content", "Range", "Rate", "Delay", "Oldest"), rows)


def _type(channel: Channel, hint: str) -> str:
    kind, *_ = hint.split()
    kind = f"({channel.shape[0]},)" if channel.shape else kind if kind in ("int", "float") else f"`{kind}`"
    unit = channel.unit.removeprefix("-").replace("^2", "²").replace(" or ", ", ")
    return f"{kind} {unit}".rstrip() + " or None" * hint.endswith("None")


def _bounds(channel: Channel) -> str:
    if channel.unit_length:
        return f"unit length within {50.0 * UNIT_TOLERANCE:g} %"
    return f"at most {channel.high:g}" if math.isfinite(channel.high) else "–"


def _times(channel: Channel) -> tuple[str, str, str]:
    """Rate, delay and greatest age."""
    rate = f"{channel.rate_hz:g} Hz" if channel.rate_hz else "–"
    delay, oldest = (
        f"{1e3 * time:g} ms" if 0.0 < time < math.inf else "–" for time in (channel.latency_s, channel.oldest_s)
    )
    return rate, delay, oldest


def put_into(text: str) -> str:
    """A page with a new table between `BEGIN` and `END`."""
    return f"{text[: text.index(BEGIN) + len(BEGIN)]}\n{frame_table()}{text[text.index(END) :]}"


if __name__ == "__main__":
    page = Path(sys.argv[1])
    page.write_text(put_into(page.read_text(encoding="utf-8")), encoding="utf-8")
