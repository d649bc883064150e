"""How many of randomly drawn vehicles are accepted and fly: ``python -m sim.experiments.vehicle_acceptance``."""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import sys
from collections.abc import Iterator

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.pilot.vehicle_check import GOOD_REACH, check_vehicle, vehicle_actuation
from sim.evaluate.metrics import compute_metrics
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions
from sim.vehicles.configuration import with_camera, with_vehicle
from sim.vehicles.generator import random_vehicle
from sim.world.scene import Scene
from sim.world.worlds import in_world

#: Fraction of the vehicles with reach and brush that are to be accepted, and of their flights that are to complete [-].
ACCEPTED_GOAL, COMPLETED_GOAL = 0.9, 0.95
#: Push of the job [N].
PUSH_N = 5.0
_WORLD = "datasheet"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Candidate:
    """A vehicle with enough reach and the brush in view, and why it cannot paint."""

    seed: int
    vehicle: VehicleParams
    problems: tuple[str, ...]


def candidates(first: int = 0) -> Iterator[Candidate]:
    """Vehicles whose reach is `GOOD_REACH` times the push and whose brush is in the picture, from a seed on."""
    seed = first
    while True:
        vehicle = random_vehicle(seed)
        found = vehicle_actuation(vehicle)
        if found.sliding_push is not None and found.hovers and found.sliding_push.push >= GOOD_REACH * PUSH_N:
            check = check_vehicle(with_vehicle(PilotConfig(), vehicle), PUSH_N, found)
            if check.picture is not None and check.picture.shows_tip:
                yield Candidate(seed=seed, vehicle=vehicle, problems=check.problems)
        seed += 1


def completes(vehicle: VehicleParams, law: str, seed: int, features: str = "geometric") -> tuple[bool, str]:
    """Whether a vehicle completes the default job, and how the flight ended."""
    scene = with_camera(in_world(Scene(), _WORLD), vehicle)
    options = FlightOptions(law=law, seed=seed, features=features, video=False, compiled=True)
    trace = fly(scene, options, config=with_vehicle(PilotConfig(law=law), vehicle))
    metrics = compute_metrics(trace)
    path, coverage = 1e3 * metrics["path_rms_straight_m"], 100.0 * metrics["coverage"]
    words = f"{metrics['not_completed'] or trace.reason}; coverage {coverage:.1f} %, path {path:.1f} mm rms"
    return bool(metrics["completed"]), words


def main() -> int:
    """Command line; exit code 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description="Fractions of accepted and flown vehicles drawn at random.")
    parser.add_argument("--vehicles", type=int, default=10, help="candidates")
    parser.add_argument("--first", type=int, default=0, help="seed of the first vehicle")
    parser.add_argument("--flights", type=int, default=10, help="accepted vehicles to fly, under each law")
    parser.add_argument("--laws", nargs="+", default=["qp", "paper"], choices=["qp", "paper"])
    parser.add_argument("--features", default="geometric", choices=["geometric", "rendered"])
    chosen = parser.parse_args()
    drawn = list(itertools.islice(candidates(chosen.first), chosen.vehicles))
    accepted = [candidate for candidate in drawn if not candidate.problems]
    for candidate in drawn:
        vehicle, words = candidate.vehicle, "; ".join(candidate.problems) or "accepted"
        print(f"vehicle {candidate.seed}: {vehicle.geometry.count} rotors, {vehicle.mass_kg:.1f} kg: {words}")
    good = _print("accepted vehicles", len(accepted), len(drawn), ACCEPTED_GOAL)
    done = flown = 0
    for candidate in accepted[: chosen.flights]:
        for law in chosen.laws:
            complete, reason = completes(candidate.vehicle, law, candidate.seed, chosen.features)
            done, flown = done + complete, flown + 1
            print(
                f"vehicle {candidate.seed}, {law}: {'completed' if complete else 'NOT completed'}, {reason}", flush=True
            )
    if flown:
        good = _print(f"completed flights, {chosen.features}, {_WORLD}", done, flown, COMPLETED_GOAL) and good
    return 0 if good else 1


def _print(name: str, count: int, total: int, goal: float) -> bool:
    share = count / max(total, 1)
    print(f"{name}: {100 * share:.0f} % (goal >= {100 * goal:.0f} %), n = {total}")
    return share >= goal


if __name__ == "__main__":
    sys.exit(main())
