"""Every kind of table that a command prints fits 80 columns, with every number whole."""

from __future__ import annotations

import io
from collections import Counter
from types import SimpleNamespace as Made

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

import ibvs_qp
from ibvs_qp.command import ActiveLimit, TaskReport
from ibvs_qp.qp.explain import Explanation, LimitRange, LimitValue
from sim.bench.loop import STAGES
from sim.bench.timing import Bench, Row
from sim.commands import bench, compare, experiment, faults
from sim.commands.cli import main
from sim.detection.report import frame_table
from sim.evaluate import explanation_text
from sim.evaluate.metrics import LINES, figure_table
from sim.evaluate.table import terminal_table

WIDTH = 80
#: A figure with more digits than any real one.
WIDE = -12345.678912345
REASON = "time-out after 15 s in align: 51.3 px of 3 px"


@pytest.fixture
def printed(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """Everything that is printed on a console."""
    found: list[object] = []
    monkeypatch.setattr(Console, "print", lambda _, *parts, **__: found.extend(parts))
    return found


def shown(table: object, width: int = WIDTH) -> str:
    """A table as a console of this width prints it."""
    file = io.StringIO()
    console = Console(file=file, width=width)
    file.writelines(segment.text for segment in console.render(table))  # type: ignore[arg-type]
    return file.getvalue()


def numbers(text: str) -> Counter[str]:
    """Words with a digit, as often as they occur."""
    return Counter(word for word in text.split() if any(letter.isdigit() for letter in word))


def assert_whole(parts: list[object], kinds: int, width: int = WIDTH) -> None:
    """Every line fits, no cell is cut, and every number of every cell is printed whole."""
    tables = [part for part in parts if isinstance(part, Table)]
    assert len(tables) == kinds
    for table in tables:
        text = shown(table, width)
        assert "…" not in text and max(map(len, text.splitlines())) <= width
        cells = " ".join(str(cell) for column in table.columns for cell in column.cells)
        missing = numbers(Console().render_str(cells).plain) - numbers(text)
        assert table.row_count and not missing, f"{missing} in\n{text}"


def explained(rotors: int) -> Explanation:
    names = ("thrust_front_right_upper", "propeller_clearance")
    task = TaskReport(name="velocity_along", unit="m/s^2", asked=WIDE, achieved=WIDE, residual=WIDE, weight=1.234e-5)
    return Explanation(
        thrusts=np.full(rotors, WIDE),
        tasks=[task],
        cost=(1.0,),
        total_cost=1.234e-5,
        slack_cost=0.5,
        active_limits=tuple(
            ActiveLimit(name=name, side="upper", price=1.234e-5, slack=1.234e-9, unit="rad/s^2") for name in names
        ),
        limit_cost=(0.25, 0.25),
        limit_rows=tuple(
            LimitValue(name=name, unit="rad/s^2", lower=WIDE, upper=-8999.9, value=WIDE) for name in names
        ),
        limit_ranges=tuple(
            LimitRange(change_low=WIDE, change_high=-WIDE, cost_fall=1.234e-5, until=f"{name} released")
            for name in names
        ),
        unallocated_wrench=np.zeros(6),
        clipped=np.zeros(rotors),
    )


def test_explain() -> None:
    config = ibvs_qp.preset("octorotor_qp")
    found = explained(config.controller.vehicle.geometry.count)
    trace = Made(thrusts=found.thrusts[None], preset="")
    rotors = explanation_text._rotors(trace, 0, config, found, False)  # type: ignore[arg-type]
    limits, conflict = explanation_text._limits(found), explanation_text._conflict(found.limit_rows)
    assert_whole([explanation_text._tasks(found), *limits, *conflict, rotors], 5)


@pytest.mark.parametrize("pairs", [2, 20])
def test_compare(printed: list[object], capsys: pytest.CaptureFixture[str], tmp_path, pairs: int) -> None:
    figures = {"a": WIDE, "b": WIDE, "median": WIDE, "low": 2.0 * WIDE, "high": WIDE, "pairs": pairs}
    cell = {"experiment": "paint", "law": "qp", "variant": "lexicographic", "params": {"world": "harsh"}, "n": 20}
    cell |= {"completed": [20, 19], "differences": {line.name: figures for line in LINES}}
    conditions = [{"name": "preset.controller.gains.force_kfp", "a": 0.123456789, "b": [0.25, 0.125, 1.0625]}]
    compare._print(conditions, [cell], tmp_path, tmp_path, "datasheet")
    assert_whole(printed, 2)
    text = shown(printed[-1], 120)
    assert ("95 %" in text, "min -" in text, "min, max" in text) == (pairs >= 6, pairs < 6, pairs < 6)


def test_vehicle_of_eight_rotors(printed: list[object], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["vehicle", "octorotor_qp"]) == 0
    assert_whole(printed, 5)


def test_paint() -> None:
    flight: dict[str, object] = {line.name: REASON if line.name == "reason" else WIDE for line in LINES}
    flight |= {"claimed": True, "completed": False}
    assert_whole([figure_table({"qp": flight, "paper": flight})], 1)


def test_experiment(printed: list[object]) -> None:
    verdict = {
        "experiment": "paint",
        "law": "paper",
        "figure": "height error, peak",
        "cell": {"wall": 10000.0, "world": "datasheet"},
    }
    verdict |= {"variant": "no-reach-check", "least": False, "unit": "rad/s^2", "median": WIDE, "held": 10, "n": 10}
    content = {"verdicts": [verdict | {"bound": WIDE, "words": "not certain (3 of 10)"}]}
    experiment._print_verdicts(Console(), content, {"paint": ["ideal", "datasheet"]})
    assert_whole(printed, 1)


def test_faults(printed: list[object]) -> None:
    judged = Made(n=20, passed=19, how=("reaction after 12.345 s", "push 12.345 N of 5 N"))
    verdict = Made(flown=judged, control=judged, row=Made(name="F/T zero"), place="contact")
    faults._print_verdicts(Console(), [Made(**vars(verdict), met=False, proves_nothing=True)], ["ideal"])  # type: ignore[list-item]
    assert_whole(printed, 1)


@pytest.mark.parametrize("size", [None, "640x480"])
def test_bench(printed: list[object], size: str | None) -> None:
    row = Row(name="qpsolvers_proxqp", size=size, times_us=[123456.7] * 1000)
    bench._show(Bench(rows=[row], stages_us={"solve": 1.0}, ratios={"rival": 1.0}, notes={"row_kinds": {"step": "x"}}))
    assert_whole(printed, 1)
    assert f"in {'us' if size is None else 'ms'}" in shown(printed[0]) and "step: x" in printed


def test_bench_loop(printed: list[object]) -> None:
    stages = {f"{flight}_{stage}": 1e9 for flight in ("rendered", "geometric") for stage in STAGES}
    bench._show_loop(Bench(rows=[], stages_us=stages, ratios={"rendered_real_time": 1e6, "geometric_real_time": 1e6}))
    assert_whole(printed, 1)


def test_detect() -> None:
    line = Made(pixels=[[123.4, 123.4], [1234.5, 1234.5]], confidence=0.123)
    found = Made(plane=Made(distance_m=12.345), guides={"bottom": line, "left": line})
    result = Made(entry=Made(color="/frames/0001_a_name_of_a_frame_0123456789.png"), detection=found, time_ms=12345.6)
    assert_whole([frame_table([result])], 1)  # type: ignore[list-item]


@pytest.mark.parametrize(("width", "parts"), [(25, 12), (40, 4), (80, 2), (200, 1)])
def test_columns_without_room_follow_below_beside_the_first_one(width: int, parts: int) -> None:
    rows = [("roll", *(f"{0.1234 + place:+.4f}" for place in range(12)))]
    table = terminal_table(("per newton of #", *map(str, range(12))), rows, "B")
    assert_whole([table], 1, width)
    assert shown(table, width).count("roll") == parts


def test_a_long_word_is_broken_and_numbers_beside_it_are_not() -> None:
    rows = [("a/path/of/more/characters/than/a/terminal/has/in/a/line/of/its/window", f"{WIDE}", "x")]
    assert_whole([terminal_table(("file", "value", "note"), rows, text=("file", "note"))], 1, 48)
