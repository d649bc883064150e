"""``ibvs-qp vehicle``."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from contract_schema import refusal

import ibvs_qp
from sim.commands.cli import main
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.vehicles.configuration import with_camera
from sim.vehicles.vehicle_file import read_vehicle
from sim.world.scene import Scene

FLAT = """[vehicle]
mass_kg = 2.0
[vehicle.geometry]
circle_radius_m = 0.25
torque_ratio_m = 0.02
rotors = [{name = "[bold]a", azimuth_deg = 45, spin = 1}, {name = "b", azimuth_deg = 135, spin = -1},
          {name = "c", azimuth_deg = -135, spin = 1}, {name = "d", azimuth_deg = -45, spin = -1}]
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def summary(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, object]:
    assert main(["vehicle", *words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_px4_parameters_have_the_same_effectiveness(capsys: pytest.CaptureFixture[str]) -> None:
    written = summary(capsys, "tarot_t960_qp", "--px4", "t960.params")
    found = summary(capsys, "t960.params")
    np.testing.assert_allclose(found["effectiveness"], written["effectiveness"], atol=1e-8)  # type: ignore[arg-type]
    assert found["missing"] == [] and found["hovers"] is True and written["push_n"] == pytest.approx(30.4, abs=0.1)


def test_a_shipped_preset_is_shown_and_drawn(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["vehicle", "octorotor_qp", "--picture", "o.png"]) == 0
    text = capsys.readouterr().out
    for words in (
        "6 kg, 8 rotors",
        "Control effectiveness B",
        "Fully actuated; condition",
        "Push at the tip:",
        "Force sensor: turns from ",
        "o.png",
    ):
        assert words in text
    assert Path("o.png").read_bytes()[:4] == b"\x89PNG"


def test_what_is_not_actuated_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    Path("flat.toml").write_text(FLAT)
    assert main(["vehicle", "flat.toml"]) == 2
    text, err = capsys.readouterr()
    assert err.count("\n") == 1 and "flat.toml: not fully actuated: the 4 rotors cannot give force front" in err
    assert "Not fully actuated." in text and "  force front\n  force right\n" in text and "[bold]a" in text


@pytest.mark.parametrize(
    ("words", "needle"),
    [
        (["none.toml"], "none.toml"),
        (["none.params"], "none.params"),
        (["bad.params"], "bad.params: CA_ROTOR_COUNT = 0 is refused"),
        (["bad.toml"], "bad.toml: unknown key 'vehicle.mass'; did you mean 'mass_kg'?"),
        (["tarot_t960_qp", "--picture", "a.doc"], "--picture = 'a.doc'"),
        (["tarot_t960_qp", "--px4", "no/folder.params"], "no/folder.params: No such file or directory"),
    ],
)
def test_user_errors_are_one_line(capsys: pytest.CaptureFixture[str], words: list[str], needle: str) -> None:
    Path("bad.params").write_text("hello\n")
    Path("bad.toml").write_text("[vehicle]\nmass = 3.0\n")
    assert needle in refusal(["vehicle", *words], capsys)


@pytest.mark.slow
def test_what_a_file_does_not_state_is_marked(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["vehicle", "tarot_t960_qp", "--px4", "t.params"]) == 0
    capsys.readouterr()
    assert main(["vehicle", "t.params", "--toml", "t.toml"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "6 kg (assumed), 6 rotors" in text
    assert "Assumed, not stated in PX4 parameters: mass_kg, inertia_kg_m2" in text
    found = summary(capsys, "t.toml")
    assert "mass_kg" in found["assumed"] and "geometry" not in found["assumed"]  # type: ignore[operator]
    assert found["push_n"] == pytest.approx(30.4, abs=0.1)


def test_derived_values_are_listed_with_their_source(capsys: pytest.CaptureFixture[str]) -> None:
    Path("own.toml").write_text("[vehicle]\nmass_kg = 3.0\ntip_position_m = [0.8, 0.0, 0.0]\n")
    assert main(["vehicle", "own.toml", "--picture", "own.png"]) == 0
    lines = {" ".join(line.split()) for line in capsys.readouterr().out.splitlines()}
    assert (
        "contact.depth_min_m 0.63 m tip and camera" in lines
        and "gains, impedance x 0.50 mass over the Tarot's" in lines
    )
    Path("stated.toml").write_text("[controller.contact]\ndepth_min_m = 0.55\n")
    assert main(["vehicle", "stated.toml"]) == 0
    assert "contact.depth_min_m 0.55 m stated" in {" ".join(x.split()) for x in capsys.readouterr().out.splitlines()}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("own", "push", "needle"),
    [
        ("camera_turn_deg = [0.0, -25.0, 0.0]", "5", "brush outside the picture"),
        ("camera_turn_deg = [0.0, 180.0, 0.0]", "5", "brush outside the picture"),
        ("camera_turn_deg = [0.0, 25.0, 0.0]", "5", "no guide position in view"),
        ("camera_position_m = [0.42, 0.24, 0.01]", "5", "lens inside the disc of propeller front_right"),
        ("tip_position_m = [0.2, 0.0, 0.0]", "5", "tip behind the force/torque sensor"),
        ("tip_position_m = [0.6, 0.0, 0.0]", "5", "tip behind the propellers"),
        ("mass_kg = 40.0", "5", "no level hover"),
        ("", "16", "reach 14.4 N is below the job's push of 16 N"),
    ],
)
def test_what_cannot_paint_is_refused_in_one_line(
    capsys: pytest.CaptureFixture[str], own: str, push: str, needle: str
) -> None:
    Path("own.toml").write_text(f"[vehicle]\n{own}\n")
    assert main(["vehicle", "own.toml", "--push", push, "--picture", "own.png"]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and needle in err and Path("own.png").exists()


def test_little_reach_and_propellers_in_view_are_warned_of(capsys: pytest.CaptureFixture[str]) -> None:
    Path("own.toml").write_text("[vehicle]\ncamera_position_m = [0.0, 0.0, 0.08]\n")
    warnings = summary(capsys, "own.toml", "--push", "12")["warnings"]
    assert "reach" in warnings[0] and "propellers in view" in warnings[1]  # type: ignore[index]
    assert summary(capsys, "tarot_t960_qp")["warnings"] == []


def test_paint_refuses_the_same_before_it_flies(capsys: pytest.CaptureFixture[str]) -> None:
    Path("own.toml").write_text("[vehicle]\ncamera_turn_deg = [0.0, -25.0, 0.0]\n")
    assert "--vehicle own.toml: brush outside the picture" in refusal(
        ["paint", "--vehicle", "own.toml", "--no-video", "--out", "run"], capsys
    )
    assert not Path("run").exists()


def test_a_vehicle_of_a_file_flies_with_scaled_gains_and_its_camera() -> None:
    Path("own.toml").write_text(
        "[vehicle]\nmass_kg = 3.0\ncamera_size_px = [424, 240]\ncamera_intrinsics_px = [300.0, 300.0, 211.5, 119.5]\n"
    )
    scene = with_camera(Scene(), read_vehicle(Path("own.toml")).vehicle)
    options = FlightOptions(law="paper", vehicle="own.toml")
    config = pilot_config(scene, options).controller
    assert config.gains.force_ksp == pytest.approx(0.5 * ibvs_qp.preset("paper").controller.gains.force_ksp)
    assert config.vehicle.camera_intrinsics_px == pytest.approx((300.0, 300.0, 211.5, 119.5), abs=0.01)
    world = World(scene, dataclasses.replace(options, features="geometric"), pilot_config(scene, options))
    assert world.plant.vehicle.mass_kg == 3.0 and world.scene.camera.width == 424
