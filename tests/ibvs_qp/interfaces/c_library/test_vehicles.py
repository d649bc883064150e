"""The self-test of the exported library passes for presets, generated vehicles and turned cameras, and can fail.

``IBVS_QP_VEHICLES`` is the number of generated vehicles.
"""

from __future__ import annotations

import dataclasses
import os
import subprocess
from pathlib import Path

import pytest
from c_library import FLAGS, make, needs_compiler

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.interfaces.c_library.library import WRENCH, write_library
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.pilot.presets import FILES
from sim.commands import export_c
from sim.commands.cli import main
from sim.vehicles.configuration import with_vehicle
from sim.vehicles.generator import random_vehicle

pytestmark = needs_compiler

TAROT = PilotConfig()
#: Seeds of generated vehicles; all have turned cameras. No simulated body has the inertia of the fourth.
SEEDS = (0, 1, 2, 3, 5, 6, 7, 8, 9, 10)[: int(os.environ.get("IBVS_QP_VEHICLES", "10"))]
TURNED = dataclasses.replace(TAROT.controller.vehicle, camera_turn_deg=(5.0, 8.0, -4.0))
VEHICLES: dict[str, VehicleParams] = {
    "tarot": TAROT.controller.vehicle,
    "turned": TURNED,
    "octorotor": PilotConfig.from_toml(FILES["octorotor_qp"]).controller.vehicle,
    **{f"seed {seed}": random_vehicle(seed) for seed in SEEDS},
}
#: A vehicle of six rotors of which the Hessian's condition is 2e5 instead of 1e4.
ILL_CONDITIONED = 10
SIX = [
    name for name, vehicle in VEHICLES.items() if vehicle.geometry.count <= WRENCH and name != f"seed {ILL_CONDITIONED}"
]
#: Ticks of recorded flights here, which reach into limited ticks, and those with broken inputs.
FEW_TICKS, BROKEN_TICKS = 400, "COUNT=2000"
#: Vehicles whose library has the estimation too.
ESTIMATED = ("turned", "octorotor", "seed 1")
STRAIGHT = "camera_turn_deg = [0.0, 0.0, 0.0]"
#: A line of `pack.c`, and the same with an error: 0.1 mm on a wall 0.1 m ahead.
PACKED, BROKEN = "inputs[RHO] = line->rho;", "inputs[RHO] = line->rho + (ibvs_real)1e-3;"


@pytest.mark.slow
def test_an_octorotor_with_a_turned_camera_passes_in_a_shell_and_fails_for_broken_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(export_c, "RECORDED_TICKS", FEW_TICKS)
    monkeypatch.setenv("CFLAGS", "-O0 -Werror")
    preset, folder = tmp_path / "turned.toml", tmp_path / "an octorotor's library"
    text = FILES["octorotor_qp"].read_text()
    assert STRAIGHT in text
    preset.write_text(text.replace(STRAIGHT, "camera_turn_deg = [5.0, 8.0, -4.0]"))
    assert main(["export-c", str(folder), "--preset", str(preset)]) == 0
    command = capsys.readouterr().out.splitlines()[-1].partition(": ")[2]
    for broken in (False, True):
        if broken:
            file = folder / "pack.c"
            assert PACKED in file.read_text()
            file.write_text(file.read_text().replace(PACKED, BROKEN))
        done = subprocess.run(command, shell=True, capture_output=True, text=True, timeout=300, check=False)
        assert (done.returncode != 0, "FAILED" in done.stdout) == (broken, broken), done.stdout + done.stderr
        assert f"{FEW_TICKS} recorded ticks" in done.stdout and "cost within" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("name", VEHICLES)
def test_every_vehicle_passes_in_double(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(export_c, "RECORDED_TICKS", FEW_TICKS)
    export_c.write_tested_library(tmp_path, with_vehicle(TAROT, VEHICLES[name]), False, name in ESTIMATED)
    assert make(tmp_path, FLAGS, "test", BROKEN_TICKS).count("passed") == (4 if name in ESTIMATED else 2)


@pytest.mark.slow
@pytest.mark.parametrize("name", SIX)
def test_every_vehicle_of_six_rotors_passes_in_float(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(export_c, "RECORDED_TICKS", FEW_TICKS)
    export_c.write_tested_library(tmp_path, with_vehicle(TAROT, VEHICLES[name]), True, False)
    assert make(tmp_path, FLAGS, "test", BROKEN_TICKS).count("passed") == 2


def test_an_ill_conditioned_vehicle_is_refused_in_float(tmp_path: Path) -> None:
    """Its thrusts would move by 0.09 N; without the check its self-test fails."""
    with pytest.raises(ConfigError, match=r"condition 2\.\de\+05 .* export it in double precision"):
        write_library(tmp_path, with_vehicle(TAROT, random_vehicle(ILL_CONDITIONED)).controller, single=True)
    assert not list(tmp_path.iterdir())
