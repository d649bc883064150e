"""Drawn scenes cover every key over its range, and their flights are checked by the truth."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from sim.flight.options import FlightOptions
from sim.flight.preflight import job_problems
from sim.scene_fuzz import __main__ as command
from sim.scene_fuzz import check
from sim.scene_fuzz.check import BAD, FEWEST, MOST, check_draw, check_file, drawn_scene, scene_keys
from sim.world.scene import Scene, load_scene

OPTIONS = FlightOptions(features="geometric", video=False, compiled=True)
#: Draws of the slow test; the command `python -m sim.scene_fuzz` flies others.
FIRST_SEED, FLIGHTS = 7000, 6


def test_draws_repeat_and_move_every_key_to_both_sides_of_its_default():
    draws = [drawn_scene(seed, "rendered", 1e4) for seed in range(400)]
    assert draws == [drawn_scene(seed, "rendered", 1e4) for seed in range(400)]
    moved = [keys for _, keys in draws]
    assert all(FEWEST <= len(keys) <= MOST for keys in moved)
    values: dict[str, set] = {path: set() for path in scene_keys("rendered")}
    for keys in moved:
        for path, value in keys.items():
            values[path].add(str(value))
    assert min(len(found) for found in values.values()) >= 2
    assert {"'fill'", "fill"} & values["paint.rows"] and {"rows", "columns"} <= values["paint.pattern"]
    widths = sorted(scene.board.width_m for scene, keys in draws if "board.width_m" in keys)
    assert widths[0] < 1.0 and widths[-1] > 4.0


def test_draws_that_take_too_long_are_drawn_again_and_strokes_fit_the_board():
    for seed in range(100):
        scene, moved = drawn_scene(seed, "geometric", 60.0)
        assert "wall.color" not in moved
        assert scene.paint.stroke_m / scene.paint.speed_m_s <= 60.0
        if "paint.stroke_m" not in moved and scene.paint.edge_margin_m <= 0.05:
            pilot = check.pilot_config(scene, OPTIONS)
            assert not any("paint.stroke_m" in text for text in job_problems(scene, pilot, "geometric"))


@pytest.mark.parametrize(
    ("completed", "claimed", "reason", "outcome"),
    [
        (True, True, "all rows painted, retreated", "complete"),
        (False, True, "all rows painted, retreated", "FALSE CLAIM"),
        (False, False, "time-out after 15 s in align", "honestly failed"),
        (True, False, "landed", "complete, not claimed"),
        (False, False, "crash: hit the ground", "CRASH"),
    ],
)
def test_outcome_is_what_the_truth_makes_of_the_claim(monkeypatch, completed, claimed, reason, outcome):
    monkeypatch.setattr(check, "fly", lambda scene, options: SimpleNamespace(reason=reason))
    figures = {"completed": completed, "claimed": claimed, "not_completed": None if completed else "row 1: short"}
    figures["push_peak_ratio"] = 3.0
    monkeypatch.setattr(check, "compute_metrics", lambda trace: figures)
    checked = check_draw(0, OPTIONS, "datasheet", 150.0)
    assert checked.outcome == outcome and (outcome in BAD) == outcome.isupper()
    assert reason in str(checked) and str(checked).endswith("(push 3.0 x)")


def test_refusals_and_internal_errors_are_told_apart(monkeypatch):
    def broken(scene, options):
        raise ZeroDivisionError("pitch")

    monkeypatch.setattr(check, "fly", broken)
    outcomes = {check_draw(seed, OPTIONS, "datasheet", 150.0).outcome for seed in range(40)}
    assert outcomes == {"refused before flight", "INTERNAL ERROR"}


def test_a_scene_of_a_file_is_refused_by_name(tmp_path):
    (tmp_path / "thin.toml").write_text("[paint]\noverlap_m = 0.08\n")
    checked = check_file(tmp_path / "thin.toml", OPTIONS, "datasheet", 3)
    assert checked.outcome == "refused before flight" and str(checked).startswith("thin 3: refused before flight: ")


@pytest.mark.parametrize(("path", "scenes"), [("thin.toml", 1), (".", 2)])
def test_one_file_is_flown_as_a_folder_is(tmp_path, monkeypatch, capsys, path, scenes):
    for name in ("thin.toml", "thick.toml"):
        (tmp_path / name).write_text("[paint]\noverlap_m = 0.08\n")  # refused before flight
    monkeypatch.setattr("sys.argv", ["scene_fuzz", "--scenes", str(tmp_path / path), "--seeds", "0", "1"])
    assert command.main() == 0
    assert f"n = {2 * scenes} flights" in capsys.readouterr().out


def test_a_folder_without_scenes_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["scene_fuzz", "--scenes", str(tmp_path)])
    with pytest.raises(SystemExit, match="2"):
        command.main()
    assert "no scene (*.toml) in" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("seed", range(FIRST_SEED, FIRST_SEED + FLIGHTS))
def test_no_drawn_scene_crashes_breaks_or_is_claimed_falsely(seed):
    checked = check_draw(seed, OPTIONS, "datasheet", 100.0)
    assert checked.outcome not in BAD, str(checked)


@pytest.mark.parametrize("features", ["geometric", "rendered"])
def test_the_hard_scenes_can_be_read_and_say_what_they_were(features):
    files = sorted((Path(check.__file__).with_name("hard") / features).glob("*.toml"))
    assert len(files) >= 3
    for file in files:
        assert load_scene(file) != Scene() and file.read_text().startswith("# ")
