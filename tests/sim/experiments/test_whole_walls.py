"""Whole walls: a balanced design, figures with goal and n from tables, and a short part flown for real."""

from collections import Counter
from types import SimpleNamespace

import pytest

from ibvs_qp.pilot.painting.pattern import COLUMNS, CORNERS, PATTERNS
from sim.experiments.scenes import short_job
from sim.experiments.whole_walls import __main__ as command
from sim.experiments.whole_walls import flights
from sim.experiments.whole_walls.figures import failures, outcomes
from sim.experiments.whole_walls.flights import SCENES, SETS, paint_run, runs_of
from sim.experiments.whole_walls.scenes import CLUTTER, HEIGHT_M, STROKES, WIDTH_M, walls
from sim.experiments.whole_walls.vision_faults import faulty_jobs
from sim.scenes import FILES
from sim.sweep.parts import frame
from sim.world.worlds import in_world

LAWS = ("qp", "paper")
PLACE = "place error of the last stroke over that of stroke 5"


@pytest.mark.parametrize("seed", range(3))
def test_every_level_of_every_factor_occurs_equally_often(seed):
    scenes = walls(seed, SCENES)
    assert scenes == walls(seed, SCENES) and scenes != walls(seed + 1, SCENES)
    paints = [scene.paint for scene in scenes]
    for values, levels in (
        ([(paint.rows, paint.pattern) for paint in paints], [(n, kind) for n in STROKES for kind in PATTERNS]),
        ([paint.start for paint in paints], CORNERS),
        ([scene.board.clutter for scene in scenes], CLUTTER),
        ([scene.board.color for scene in scenes], FILES),
    ):
        counts = Counter(values)
        assert len(counts) == len(levels)
        assert max(counts.values()) - min(counts.values()) <= 1
    assert len({scene.board.texture_seed for scene in scenes}) == SCENES
    for low, high, sizes in (
        (*WIDTH_M, [scene.board.width_m for scene in scenes]),
        (*HEIGHT_M, [scene.board.height_m for scene in scenes]),
    ):
        assert low <= min(sizes) < low + 0.25 * (high - low) and high - 0.1 * (high - low) < max(sizes) <= high


def test_strokes_keep_the_margin_at_both_ends():
    for scene in walls(0, SCENES):
        length = scene.board.height_m if scene.paint.pattern == COLUMNS else scene.board.width_m
        assert scene.paint.stroke_m == pytest.approx(length - 2 * scene.paint.edge_margin_m)


@pytest.mark.slow
def test_both_laws_fly_the_same_checked_scenes_and_there_are_200_flights_with_faults():
    runs = runs_of(SETS, LAWS)  # a scene that is refused raises here
    assert [run.expected_s for run in runs] == sorted(run.expected_s for run in runs)
    flown = {law: [(run.experiment, run.seed, run.plan.scene) for run in runs if run.law == law] for law in LAWS}
    assert flown["qp"] == flown["paper"]
    counts = Counter((run.experiment, run.law) for run in runs)
    assert counts["datasheet", "qp"] == counts["harsh", "paper"] == 20 and counts["rendered", "qp"] == 6
    assert sum(counts[name, law] for name in SETS if "faults" in name for law in LAWS) == 200


def test_hidden_guides_lie_before_the_tip_in_every_pattern():
    hidden = {}
    for name, _, scene, (fault,) in faulty_jobs(0, "geometric"):
        if name == "guide hidden for 1 s":
            hidden[scene.paint.pattern, scene.paint.start] = fault
    assert len(hidden) == len(PATTERNS) * len(CORNERS)
    tip = -0.16
    assert hidden["rows", "bottom-left"].down == pytest.approx(tip + 0.08)
    assert hidden["rows", "top-left"].down == pytest.approx(tip - 0.08)
    upright = hidden["columns", "top-right"]
    assert upright.right == pytest.approx(0.08) and upright.half_height > upright.half_width


def table(*rows):
    """Made-up flights of set datasheet: (done, claimed, coverage, growth of the place error)."""
    facts = {"experiment": "datasheet", "law": "qp", "variant": "standard", "reason": "the end"}
    return frame(
        [
            facts | {"seed": seed, "claimed": claimed, "done": done, "coverage": coverage, "place_growth": growth}
            for seed, (done, claimed, coverage, growth) in enumerate(rows)
        ]
    )


def planned(count):
    return [SimpleNamespace(experiment="datasheet", law="qp")] * count


def test_figures_of_good_flights_meet_their_goals():
    found = {line.words: line for line in outcomes(table((1.0, True, 0.99, None), (1.0, True, 0.981, 1.5)), planned(3))}
    assert all(line.met for line in found.values())
    assert found[f"datasheet, qp: {PLACE}"].cells[2:] == ("1.5", "1.5", "1 of 1, 3 planned", "yes")
    assert found["datasheet, qp: complete"].cells[1] == ">= 1 in 100 %"


@pytest.mark.parametrize(
    ("row", "missed"),
    [
        ((0.0, True, 0.99, 1.0), {"complete", "false claims"}),
        ((0.0, False, 0.99, 1.0), {"complete"}),
        ((1.0, False, 0.99, 1.0), {"claimed, of the complete flights"}),
        ((1.0, True, 0.979, 1.0), {"coverage"}),
        ((1.0, True, 0.99, 2.1), {PLACE}),
        ((None, False, None, None), {"complete", "coverage", PLACE}),
    ],
)
def test_every_goal_can_be_missed(tmp_path, row, missed):
    rows = table(row)
    found = {line.words.removeprefix("datasheet, qp: ") for line in outcomes(rows, planned(1)) if not line.met}
    assert found == missed
    assert len(list(failures(rows, tmp_path))) == int(missed != {PLACE})


def test_figures_without_flights_have_no_value():
    assert all(line.met and line.cells[-1] == "–" for line in outcomes(frame([]), planned(2)))


@pytest.mark.slow
def test_parts_add_up_and_are_not_flown_again(monkeypatch, tmp_path, capsys):
    def short(name, laws, seed=0):
        scenes = [in_world(short_job(stroke_m), "ideal") for stroke_m in (0.3, 0.35)]
        return [paint_run(name, "standard", scene, "qp", seed, "geometric") for scene in scenes]

    monkeypatch.setattr(flights, "wall_runs", short)

    def fly(*words):
        monkeypatch.setattr("sys.argv", ["whole_walls", "harsh", "--laws", "qp", "--out", str(tmp_path), *words])
        code = command.main()
        return code, capsys.readouterr().out

    assert "1 of 1, 2 planned" in fly("--part", "1", "--of", "2")[1]
    code, text = fly("--part", "2", "--of", "2")
    assert code == 0 and "2 of 2, 2 planned" in text
    monkeypatch.setattr("sim.sweep.flying.fly", None)  # nothing flies any more
    assert fly("--part", "0")[0] == 0
