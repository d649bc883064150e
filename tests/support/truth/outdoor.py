"""Guides in truth frames taken outside, family by family: ``python -m tests.support.truth.outdoor --frames 100``."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from sim.detection.own import OwnMethod
from sim.world.errors import OutdoorErrors
from tests.support.truth.accuracy import HIGH_CONFIDENCE, Errors
from tests.support.truth.frame import TruthFrame, render_frame
from tests.support.truth.picture import plain_picture
from tests.support.truth.scenes import Variation, sample_scene

#: One effect each, stronger than in most scenes outside.
OUTSIDE = {
    "glare": OutdoorErrors(glare=1.2, overexposure=0.4),
    "beam shadow": OutdoorErrors(beams=2, beam_shade=0.7),
    "own shadow": OutdoorErrors(own_shade=0.7),
    "rust": OutdoorErrors(rust_per_m=12.0),
    "stains": OutdoorErrors(stains_per_m2=40.0),
    "low light": OutdoorErrors(low_light=0.8),
    "broken edges": OutdoorErrors(broken_m=0.3),
    "wet paint": OutdoorErrors(wet_gloss=0.7, wet_holes=0.7),
    "drops and dust": OutdoorErrors(drops=14, dust=20),
}


@dataclass
class Figures:
    """Guides of the detector in one family."""

    errors: Errors = field(default_factory=Errors)
    sure_wrong: list[int] = field(default_factory=list)  # seeds of frames with a guide that is sure and wrong

    def __str__(self) -> str:
        errors = self.errors
        sure = sum(confidence >= HIGH_CONFIDENCE for confidence in errors.confidence)
        return (
            f"recall {100.0 * errors.found:5.1f} % of {errors.visible:4d}  sure and wrong {len(self.sure_wrong)} "
            f"{self.sure_wrong or ''}  wrong {len(errors.wrong)}  sure {sure} of {len(errors.confidence)}  "
            f"refused {len(errors.refused)}"
        )


def frames(families: Iterable[str], seed: int) -> Iterator[tuple[str, TruthFrame]]:
    """One board 5 cm before brick, once with the effects of every family."""
    base = sample_scene(Variation(), seed)
    plain = plain_picture(base, np.random.default_rng())
    for family in families:
        yield family, render_frame(replace(base, outdoor=OUTSIDE[family]), plain=plain)


def measure(families: Iterable[str], seeds: Iterable[int]) -> dict[str, Figures]:
    """Figures of every family."""
    found, method = {family: Figures() for family in families}, OwnMethod()
    for seed in seeds:
        for family, truth in frames(found, seed):
            errors, figures = Errors(), found[family]
            errors.add(truth, method.detect(truth.frame, truth.seed), f"seed {seed}")
            if any(confidence >= HIGH_CONFIDENCE for confidence in errors.wrong):
                figures.sure_wrong.append(seed)
            figures.errors.pool(errors)
    return found


def main() -> None:
    """Print one line per family."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=100, help="frames per family")
    parser.add_argument("--first-seed", type=int, default=0, help="seed of the first frame")
    parser.add_argument("--family", choices=tuple(OUTSIDE), help="one family only")
    parser.add_argument("--show-missed", action="store_true", help="list the missed edges")
    options = parser.parse_args()
    seeds = range(options.first_seed, options.first_seed + options.frames)
    for name, figures in measure([options.family] if options.family else OUTSIDE, seeds).items():
        print(f"{name:15s} {options.frames} frames  {figures}")
        if options.show_missed:
            for missed in [*figures.errors.missed, *figures.errors.refused]:
                print(f"    {missed}")


if __name__ == "__main__":
    main()
