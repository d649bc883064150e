"""Fly the cases and write recordings and reference outputs: ``python -m tests.replay.recorder``.

With ``--outputs-only`` nothing flies: the stored inputs are replayed and the reference outputs written anew, as after
a change that is meant to change commands.
"""

from __future__ import annotations

import argparse
import copy
from dataclasses import replace
from typing import Any

import numpy as np

from . import internals
from .cases import CASES, DATA, Case
from .recordings import Recording, save
from .replayer import replay

#: What the scenes have beside the near start: sections and their values.
SCENES: dict[str, dict[str, dict[str, Any]]] = {
    "heavy_noise": {"features": {"sigma_vs": 0.12}, "force_torque": {"sigma_n": 3.0}},
}
SEEDS = {"heavy_noise": 1}
#: The rotor that stops, and when after the touch [s].
LOST_ROTOR, LOST_AFTER_S = "front_left", 1.0
#: Small pictures, seldom, so that the files stay small.
IMAGE_SIZE, PICTURE_RATE_HZ = (424, 240), 10.0


def fly(name: str, case: Case) -> Recording:
    """Fly a case in the closed loop and keep what went into pilot and controller."""
    from sim.experiments.scenes import near_wall
    from sim.faults.rotors import Derate
    from sim.faults.schedule import FaultSchedule
    from sim.flight.options import FlightOptions, pilot_config
    from sim.flight.surroundings import World

    camera = {"depth_noise_relative": 0.0, "rate_hz": PICTURE_RATE_HZ}  # the noise is added at loading
    scene = near_wall(**({"camera": camera} if case.pictures else {}), **SCENES.get(name, {}))
    scene = replace(scene, paint=replace(scene.paint, push_n=case.push_n))
    config = case.config()
    options = FlightOptions(
        law=config.law,
        seed=SEEDS.get(name, 0),
        features="rendered" if case.pictures else "geometric",
        vision=case.perception,
        image_size=IMAGE_SIZE if case.pictures else None,
        video=False,
    )
    assert pilot_config(scene, options, config) == config, f"{name}: the replayed pilot is configured otherwise"
    world, pilot, recording = World(scene, options, config), case.pilot(), Recording()
    lost = (Derate(delay_s=LOST_AFTER_S, rotor=LOST_ROTOR, share=0.0),) if name == "rotor_loss" else ()
    faults = FaultSchedule(lost)
    for _ in range(round(case.flight_s / config.controller.tick_s)):
        faults.tick(world, pilot)
        frame = world.sense()
        recording.frames.append(copy.deepcopy(frame))
        recording.thrust_limits.append(pilot.thrust_limits)
        world.act(pilot.step(frame).thrusts)
        assert world.plant.crashed is None, f"{name}: {world.plant.crashed}"
        measurement, reference = internals.controller_inputs(pilot)
        for shared in ("attitude", "angular_velocity", "specific_force", "stamp_ns", "wrench_stamp_ns"):
            assert np.array_equal(getattr(measurement, shared), getattr(frame, shared)), f"{name}: {shared}"
        recording.measurements.append(copy.deepcopy(measurement))
        recording.references.append(copy.deepcopy(reference))
    world.close()
    return recording


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Record the flights of the replay test.")
    parser.add_argument("cases", nargs="*", metavar="CASE", help=f"of {', '.join(CASES)}; all if none is given")
    parser.add_argument("--outputs-only", action="store_true", help="keep the inputs, replay them, write the outputs")
    arguments = parser.parse_args()
    DATA.mkdir(exist_ok=True)
    for name in arguments.cases or CASES:
        written = [DATA / f"{name}.outputs.npz"]
        if not arguments.outputs_only and CASES[name].inputs_of is None:
            written.append(DATA / f"{name}.inputs.npz")
            save(fly(name, CASES[name]), written[-1])
        np.savez_compressed(written[0], **replay(name))  # type: ignore[arg-type]
        print(", ".join(f"{file.name} {file.stat().st_size / 1e3:.0f} kB" for file in written))


if __name__ == "__main__":
    main()
