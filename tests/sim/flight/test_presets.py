"""The shipped presets: vehicle and brush written out in full, every number the same as its one source."""

from __future__ import annotations

import dataclasses
import json
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from closed_loop_rigs import short_scene
from reach_oracle import OCTOROTOR

import ibvs_qp
from allocation import TAROT_T960, Rotor, RotorGeometry
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.contact_margin import BrushSettings
from ibvs_qp.config.settings import from_dict
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.presets import FOLDER
from sim.evaluate.metrics import compute_metrics
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions

FILES = sorted(FOLDER.glob("*.toml"))
#: What differs from the nominal vehicle, by the beginning of the file's name.
OCTO_VEHICLE = VehicleParams(geometry=OCTOROTOR, thrust_max_n=35.0, propeller_radius_m=0.165)
VEHICLES = {"tarot_t960": VehicleParams(), "octorotor": OCTO_VEHICLE}
every_preset = pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)


def keys(kind: type) -> set[str]:
    return {field.name for field in dataclasses.fields(kind)}


def written(file: Path) -> dict[str, Any]:
    return tomllib.loads(file.read_text(encoding="utf-8"))


def test_a_preset_for_each_law_and_an_octorotor() -> None:
    assert [file.stem for file in FILES] == ["octorotor_qp", "tarot_t960_paper", "tarot_t960_qp"]


@every_preset
def test_vehicle_and_brush_are_written_out_in_full(file: Path) -> None:
    table = written(file)["controller"]
    assert set(table["vehicle"]) == keys(VehicleParams)
    assert set(table["vehicle"]["geometry"]) == keys(RotorGeometry)
    on_circle = keys(Rotor) - {"position_m", "axis", "torque_ratio_m"}
    assert all(set(rotor) == on_circle for rotor in table["vehicle"]["geometry"]["rotors"])
    assert set(table["brush"]) == keys(BrushSettings)


@every_preset
def test_every_number_agrees_with_its_source(file: Path) -> None:
    vehicle, law = file.stem.rsplit("_", 1)
    config = PilotConfig.from_toml(file)
    assert config.law == law
    assert config.controller.vehicle == VEHICLES[vehicle]
    assert config.controller.brush == BrushSettings()
    tuned = dataclasses.replace(
        PilotConfig(law=law), controller=ControllerConfig(vehicle=VEHICLES[vehicle], gains=config.controller.gains)
    )
    assert config == tuned, "vehicle, brush and gains are all that a preset says"
    if law == "qp":
        assert config.controller.gains == ControllerConfig().gains, "the defaults are the tuned gains of the program"
    assert config.painting.brush_width_m == PaintingConfig().brush_width_m


@every_preset
def test_round_trip(file: Path) -> None:
    config = PilotConfig.from_toml(file)
    assert from_dict(PilotConfig, tomllib.loads(config.to_toml())) == config


@pytest.mark.parametrize("law", ["qp", "paper", "mpc"])
def test_the_kept_search_is_what_its_page_says(law: str) -> None:
    """It kept the shipped gains, from which it started."""
    docs = Path(__file__).parents[3] / "docs"
    search = json.loads((docs / "tuning" / f"{law}_trials.json").read_text(encoding="utf-8"))
    assert search["law"] == law
    assert search["trials"] == len(search["all_trials"]) == 200 and search["features"] == "geometric"
    rows = re.findall(
        r"^\| (.+?) \| (.+?) \| (.+?) \| (.+?) \|$", (docs / "tuning.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    cells = {title: dict(zip(("qp", "paper", "mpc"), values, strict=True)) for title, *values in rows}
    assert cells["trials that completed every flight"][law] == str(search["completed_trials"])
    others = len(search["finalists"]) - 1
    assert cells["finalists that may replace the shipped preset"][law].endswith(f" of {others}")
    assert search["chosen"] is None and search["gains"] is None
    failed, path = ([each[key] for each in search["finalists"].values()] for key in ("failed", "scenes"))
    why = cells["reason for no choice"][law]
    if law == "qp":
        low, high = (round(100.0 * share) for share in (min(failed[1:]), max(failed[1:])))
        assert why == f"{low} to {high} % of their flights of the choice fail" and not failed[0]
    elif law == "mpc":
        assert why == search["objection"].replace("preset of the start", "shipped weights")
        return
    else:
        own, found = (each["sticking slide"]["path_rms_m"] for each in path)
        assert why == f"the path of the sticking slide is {found / own:.1f} times as wide"
    first = search["all_trials"][0]
    shipped = ibvs_qp.preset(law).controller
    if law == "qp":
        assert first["smoothness"] == shipped.weights.smoothness
    searched = set(first) & {field.name for field in dataclasses.fields(shipped.gains)}
    assert len(searched) == 22 and all(first[gain] == getattr(shipped.gains, gain) for gain in searched)


def test_the_presets_of_the_laws_are_those_that_fly_by_default() -> None:
    assert VEHICLES["tarot_t960"].geometry == TAROT_T960
    for law in ("qp", "paper"):
        assert ibvs_qp.preset(law) == PilotConfig.from_toml(FOLDER / f"tarot_t960_{law}.toml")


def test_the_octorotor_paints() -> None:
    scene = short_scene(stroke_m=0.3, rows=1)
    options = FlightOptions(features="geometric", video=False, preset=str(FOLDER / "octorotor_qp.toml"))
    trace = fly(scene, options)
    assert trace.claimed and trace.thrusts.shape[1] == 8
    assert compute_metrics(trace)["force_rms_straight_n"] <= 0.35
