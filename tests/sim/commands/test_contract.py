"""Names and shapes that others rely on: every public name exists, every JSON follows its schema."""

from __future__ import annotations

import dataclasses
import importlib
import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from contract_schema import M_NUMBERS, check_metrics
from synthetic_trace import synthetic_trace

from sim.commands.cli import main
from sim.evaluate.figures import FIGURES
from sim.evaluate.metrics import compute_metrics
from sim.report.rundir import as_json

NAMES = {
    "allocation": ["RotorGeometry", "TAROT_T960", "control_effectiveness"],
    "ibvs_qp": ["ControllerConfig", "HybridController", "PaperController", "Pilot", "PilotConfig", "Measurement",
                "LineFeature", "LineReference", "Reference", "Command", "TaskReport", "ActiveLimit", "Outcome",
                "SensorFrame", "RgbdFrame", "FeatureFrame"],
    "ibvs_qp.vision": ["line_interaction_matrix"],
}  # fmt: skip

FIELDS = {
    "Measurement": "stamp_ns attitude angular_velocity specific_force contact_wrench wrench_stamp_ns lines plane "
    "plane_stamp_ns velocity velocity_covariance thrust_min thrust_max",
    "LineFeature": "rho theta covariance role weight stamp_ns track_id segment",
    "LineReference": "rho theta role",
    "Reference": "push_force standoff lines velocity contact",
    "Command": "stamp_ns thrusts wrench outcome mode rejected tasks active_limits unallocated_wrench reach_margin "
    "iterations solve_time_s",
    "TaskReport": "name unit weight asked achieved residual",
    "ActiveLimit": "name side price slack unit",
    "SensorFrame": "stamp_ns attitude angular_velocity specific_force wrench wrench_stamp_ns image features",
    "RgbdFrame": "rgb depth intrinsics stamp_ns",
    "FeatureFrame": "lines plane stamp_ns",
    "ControllerConfig": "vehicle gains weights limits solver impedance contact_feedforward touch_ramp reach_check "
    "barriers",
    "PilotConfig": "controller camera vision estimation painting law",
}

SCENE = {
    "board": "width_m height_m bottom_m slope_deg gap_m color clutter texture_seed",
    "wall": "color texture_seed friction stiffness_n_m damping_n_s_m",
    "paint": "color brush_width_m edge_margin_m rows stroke_m overlap_m speed_m_s push_n",
    "start": "distance_m right_m down_m yaw_deg",
    "plant": "mass_kg inertia_kg_m2 com_offset_m thrust_min_n thrust_max_n motor_lag_up_s motor_lag_down_s",
    "camera": "width height vertical_fov_deg rate_hz latency_s depth_noise_relative",
    "force_torque": "rate_hz sigma_n sigma_nm bias_n latency_s",
    "imu": "rate_hz gyro_density accel_density attitude_bias_deg attitude_noise_deg",
    "features": "sigma_vs",
    "wind": "mean_m_s gust_n_rms",
}


@pytest.mark.parametrize(("module", "name"), [(module, name) for module, names in NAMES.items() for name in names])
def test_public_name(module, name):
    assert hasattr(importlib.import_module(module), name)


@pytest.mark.parametrize("name", FIELDS)
def test_type_has_its_fields_and_is_frozen(name):
    kind = getattr(importlib.import_module("ibvs_qp"), name)
    fields = {field.name: field for field in dataclasses.fields(kind)}
    assert set(FIELDS[name].split()) <= set(fields)
    assert kind.__dataclass_params__.frozen
    assert all(field.kw_only for field in fields.values())


@pytest.mark.parametrize("name", ["ControllerConfig", "PilotConfig"])
def test_configs_construct_without_arguments_and_survive_toml(name, tmp_path):
    kind = getattr(importlib.import_module("ibvs_qp"), name)
    config = kind()
    written = config.to_toml()
    file = tmp_path / "config.toml"
    file.write_text(written if isinstance(written, str) else file.read_text())
    assert kind.from_toml(file) == config


def test_outcomes():
    from ibvs_qp.command import Outcome

    named = ["solved", "inaccurate_accepted", "capped_accepted", "exact_fallback", "analytic_fallback", "hold"]
    assert [outcome.value for outcome in Outcome] == named


@pytest.mark.parametrize("section", SCENE)
def test_scene_keys(section):
    from sim.world.scene import Scene

    fields = {field.name for field in dataclasses.fields(getattr(Scene(), section))}
    assert set(SCENE[section].split()) <= fields


def test_controllers_share_one_interface():
    ibvs_qp = importlib.import_module("ibvs_qp")
    for kind in (ibvs_qp.HybridController, ibvs_qp.PaperController):
        assert callable(kind.step) and callable(kind.reset)
    assert callable(ibvs_qp.Pilot.step)


def test_metrics_follow_the_schema():
    metrics = json.loads(as_json(compute_metrics(synthetic_trace())))
    check_metrics(metrics)
    assert set(metrics) == {*(name.split(".")[0] for name, figure in FIGURES.items() if figure.of), "rows"}
    assert set(metrics) >= {*M_NUMBERS, "claimed", "completed", "not_completed", "reason", "push_reduced"}


def test_json_has_null_for_what_is_not_finite():
    value = {"a": float("nan"), "b": [np.float64("inf"), np.int64(3)], "c": np.bool_(True)}
    assert as_json(value) == '{"a": null, "b": [null, 3], "c": true}'


def test_example_of_the_readme_runs():
    text = (Path(__file__).parents[3] / "README.md").read_text(encoding="utf-8")
    block = next(block for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "HybridController" in block)
    names: dict = {}
    exec(compile(block, "README.md", "exec"), names)
    assert names["command"].outcome == "solved"
    assert names["command"].rejected == ()


def test_the_printed_command_is_one_that_a_shell_takes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in (
        "ibvs_qp.interfaces.c_library.library.write_library",
        "ibvs_qp.interfaces.c_library.recorded.write_recorded",
    ):
        monkeypatch.setattr(name, lambda *_: None)
    monkeypatch.setattr("sim.bench.ticks.press_flight", lambda *_: [])
    folder = tmp_path / "my lib's; controller"
    assert main(["export-c", str(folder)]) == 0
    (line,) = (line for line in capsys.readouterr().out.splitlines() if "make" in line)
    assert shlex.split(line.partition(": ")[2]) == ["make", "-C", str(folder), "test"]
