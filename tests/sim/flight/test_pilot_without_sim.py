"""The pilot needs no simulator: recorded sensor frames give the same thrusts in a process that cannot import sim."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from closed_loop_rigs import short_scene

from ibvs_qp.pilot import Pilot
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World

#: Flies recorded frames where any import of the simulator fails.
REPLAY = """
import pickle, sys
import importlib.abc

class NoSimulator(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("sim", "mujoco"):
            raise ImportError(f"{name} is out of reach")

sys.meta_path.insert(0, NoSimulator())
from ibvs_qp.pilot import Pilot

with open(sys.argv[1], "rb") as file:
    config, frames = pickle.load(file)
pilot = Pilot(config)
if any(frame.image is not None for frame in frames):
    pilot.prepare()
thrusts = [pilot.step(frame).thrusts for frame in frames]
with open(sys.argv[2], "wb") as file:
    pickle.dump((thrusts, sorted(name for name in sys.modules if name.split(".")[0] in ("sim", "mujoco"))), file)
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("features", "law"),
    [
        ("geometric", "qp"),
        ("geometric", "paper"),
        ("rendered", "qp"),
        ("rendered", "paper"),
    ],
)
def test_same_thrusts_without_the_simulator(law: str, features: str, tmp_path: Path) -> None:
    scene = short_scene(stroke_m=0.2, rows=1)
    options = FlightOptions(law=law, seed=5, features=features, video=False)
    config = pilot_config(scene, options)
    pilot, world = Pilot(config), World(scene, options, config)
    if features == "rendered":
        pilot.prepare()
    frames, thrusts = [], []
    for _ in range(1000):
        frames.append(world.sense())
        thrusts.append(pilot.step(frames[-1]).thrusts)
        world.act(thrusts[-1])
    recording, answer = tmp_path / "frames.pkl", tmp_path / "thrusts.pkl"
    recording.write_bytes(pickle.dumps((config, frames)))
    subprocess.run([sys.executable, "-c", REPLAY, str(recording), str(answer)], check=True, timeout=300)
    replayed, leaked = pickle.loads(answer.read_bytes())
    assert leaked == []
    assert np.array_equal(np.array(thrusts), np.array(replayed))
