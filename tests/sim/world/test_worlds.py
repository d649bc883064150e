"""Profiles of errors: shipped worlds, how unkind they are at least, errors one at a time, refusals."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

import pytest

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import dump_toml
from sim.flight.options import FlightOptions, pilot_config
from sim.world.errors import PROFILES, WorldErrors, single_errors, world_errors, world_names
from sim.world.scene import Scene
from sim.world.worlds import DEFAULT_WORLD, OWN, in_world, world_name

#: Least sizes by dotted name; of a vector every entry.
DATASHEET = {
    "body.mass": 0.0167, "body.com_m": (0.003, 0.005, 0.003), "attitude.bias_deg": 0.5, "gyro.density": 1e-3,
    "accelerometer.density": 0.01, "accelerometer.bias_m_s2": 0.02, "accelerometer.vibration_m_s2": 0.3,
    "force_torque.noise_n": 0.2, "force_torque.noise_nm": 0.01, "force_torque.bias_n": 0.15,
    "force_torque.drift_n_min": 0.1, "force_torque.gain": 0.01, "force_torque.cross_talk": 0.01,
    "rotors.gain": 0.02, "rotors.spread": 0.02, "rotors.noise": 0.01, "camera.mount_deg": 0.15,
    "camera.mount_m": 0.001, "camera.exposure_s": 0.005, "camera.distortion_k1": 0.005,
    "depth.noise_relative": 0.0075, "timing.stamp_error_s": 0.003, "timing.stamp_jitter_s": 0.002,
}  # fmt: skip
HARSH = {
    "body.mass": 0.05, "body.com_m": (0.005, 0.010, 0.005), "body.inertia": 0.05, "attitude.bias_deg": 1.0,
    "attitude.noise_deg": 0.1, "gyro.bias_rad_s": 0.002, "gyro.vibration_rad_s": 0.02,
    "accelerometer.bias_m_s2": 0.05, "accelerometer.vibration_m_s2": 0.5, "force_torque.noise_n": 0.3,
    "force_torque.noise_nm": 0.02, "force_torque.bias_n": 0.3, "force_torque.drift_n_min": 0.3,
    "force_torque.gain": 0.03, "force_torque.cross_talk": 0.02, "rotors.gain": 0.05, "rotors.spread": 0.03,
    "rotors.noise": 0.02, "camera.mount_deg": 0.3, "camera.mount_m": 0.002, "camera.focal": 0.005,
    "camera.exposure_s": 0.008, "camera.defocus_px": 1.0, "camera.distortion_k1": 0.01,
    "depth.noise_relative": 0.01, "timing.stamp_error_s": 0.005, "timing.stamp_jitter_s": 0.004,
}  # fmt: skip
#: Fields that shape an error but are no size.
SHAPES = {"attitude.wander_time_s", "rotors.noise_time_s", "depth.baseline_m"}
#: Sections of `field` alone.
OUTSIDE = ("air.", "arm.", "brush.", "outdoor.", "relief.")


def flat(errors: WorldErrors) -> dict[str, Any]:
    """Every field by its dotted name."""
    parts = dataclasses.asdict(errors)
    return {f"{part}.{name}": value for part, fields in parts.items() for name, value in fields.items()}


def reaches(value: Any, least: Any) -> bool:
    """Whether every entry is at least as large in size."""
    values, bounds = (entry if isinstance(entry, tuple) else (entry,) for entry in (value, least))
    return all(abs(one) >= abs(other) for one, other in zip(values, bounds, strict=True))


@pytest.mark.parametrize(("world", "least"), [("datasheet", DATASHEET), ("harsh", HARSH)])
def test_a_profile_is_at_least_as_unkind_as_agreed(world, least):
    found = flat(world_errors(world))
    assert [name for name, bound in least.items() if not reaches(found[name], bound)] == []


def test_every_error_is_set_and_harsh_is_harsher_than_datasheet():
    datasheet, harsh = flat(world_errors("datasheet")), flat(world_errors("harsh"))
    for name in datasheet.keys() - SHAPES:
        if name.startswith(OUTSIDE):
            continue
        assert datasheet[name] not in (0.0, (0.0, 0.0, 0.0)), name
        mild, hard = datasheet[name], harsh[name]
        if name == "force_torque.overload_n":  # a sensor that saturates earlier is worse
            mild, hard = hard, mild
        assert reaches(hard, mild) and hard != mild, name


@pytest.mark.parametrize("world", ["datasheet", "harsh"])
def test_every_number_of_a_profile_has_a_comment(world):
    lines = (PROFILES / f"{world}.toml").read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if re.match(r"\w+ =", line) and " # " not in line] == []


@pytest.mark.parametrize("name", ["harsh", "field"])
def test_errors_come_one_at_a_time(name):
    world, ideal = world_errors(name), flat(WorldErrors())
    singles = single_errors(world)
    assert set(singles) == {key for key, value in flat(world).items() if value != ideal[key]}
    for error, alone in singles.items():
        changed = {key for key, value in flat(alone).items() if value != ideal[key]}
        assert changed == {error} and flat(alone)[error] == flat(world)[error]
    assert single_errors(world_errors("ideal")) == {}


def test_worlds_have_names(tmp_path):
    assert world_names() == ["datasheet", "field", "harsh", "ideal", "twice_harsh"] and DEFAULT_WORLD in world_names()
    assert {name: world_name(in_world(Scene(), name).errors) for name in world_names()} == {
        name: name for name in world_names()
    }
    file = tmp_path / "mine.toml"
    file.write_text("[gyro]\nbias_rad_s = 0.004\n", encoding="utf-8")
    mine = in_world(Scene(), str(file)).errors
    assert mine.gyro.bias_rad_s == 0.004 and world_name(mine) == OWN
    file.write_text(dump_toml(world_errors("harsh")), encoding="utf-8")
    assert world_errors(str(file)) == world_errors("harsh")


@pytest.mark.parametrize(
    ("content", "said"),
    [("[gyro]\nbias = 1.0\n", "unknown key 'gyro.bias'"), ("[gyro]\nbias_rad_s = 9.0\n", "gyro.bias_rad_s = 9.0")],
)
def test_a_wrong_file_is_refused_by_name(tmp_path, content, said):
    file = tmp_path / "mine.toml"
    file.write_text(content, encoding="utf-8")
    with pytest.raises(ConfigError, match=re.escape(said)):
        world_errors(str(file))


def test_an_unknown_world_is_refused_with_the_known_ones():
    with pytest.raises(ConfigError, match="world 'kind' is refused; known worlds: datasheet, field, harsh, ideal"):
        in_world(Scene(), "kind")
    with pytest.raises(ConfigError, match=r"cannot read nowhere\.toml"):
        in_world(Scene(), "nowhere.toml")


@pytest.mark.parametrize(("world", "trim_deg"), [("datasheet", 0.0), ("harsh", 0.0), ("field", 2.0)])
def test_jobs_outside_permit_a_tilt(world: str, trim_deg: float) -> None:
    for law in ("qp", "paper"):
        config = pilot_config(in_world(Scene(), world), FlightOptions(law=law))
        assert config.controller.limits.trim_deg == trim_deg
