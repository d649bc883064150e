"""A few seconds of closed loop, from just before the wall to a stretch of sliding: what one change flies."""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass, field

from ibvs_qp.painting.command import PainterInput, PaintingCommand
from ibvs_qp.painting.config import PaintingConfig
from ibvs_qp.painting.painter import Painter
from ibvs_qp.painting.presser import Presser
from ibvs_qp.pilot import PilotConfig
from sim.experiments.scenes import near_wall
from sim.flight.closed_loop import FlightOptions, default_preset, fly, pilot_config
from sim.flight.trace import Trace
from sim.notebook.short import unless_short
from sim.world.scene import Scene

#: Pressing at one place, then sliding along the edge [s]: the push settles within a second, a line within two.
HOLD_S, SLIDE_S = 1.6, 1.4
#: Short form, for tests [s].
SHORT_HOLD_S, SHORT_SLIDE_S = 1.2, 0.3
#: A flight that has not come to its end by then is ended, whatever it does [s].
LONGEST_S = 10.0
#: Flights kept; going back to a setting shows it at once.
KEPT_FLIGHTS = 64


@dataclass(frozen=True, kw_only=True)
class Setting:
    """What is flown: the pilot's configuration, the scene, the seed; equal settings fly the same to the bit."""

    pilot: PilotConfig = field(default_factory=lambda: default_preset("qp"))
    scene: Scene = field(default_factory=near_wall)
    seed: int = 0


class _Snippet(Presser):
    """A press and a slide: no waiting until the lines have settled, no way back, an end at any rate."""

    def step(self, inputs: PainterInput) -> PaintingCommand:
        if inputs.time_s > LONGEST_S:
            self._end(inputs, f"ended after {LONGEST_S:g} s in {self.phase}", failed=True)
        return super().step(inputs)

    def _align(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        self._anchor = float(inputs.odometer[0])
        self._enter(inputs, "press", "lines settle on the way")
        return super()._press(inputs, dt)

    def _retreat(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        self._end(inputs, self.reason if self.failed else "pressed and slid")
        return super()._retreat(inputs, dt)


@dataclass(frozen=True, kw_only=True)
class SnippetJob:
    """Press for `hold_s`, slide for `slide_s` [s], and end there."""

    hold_s: float = HOLD_S
    slide_s: float = SLIDE_S

    def strategy(self, config: PaintingConfig) -> Painter:
        """The strategy."""
        return _Snippet(config, self.hold_s, self.slide_s)

    def expected_s(self, config: PaintingConfig) -> float:
        """Hold and slide."""
        return self.hold_s + self.slide_s


def fly_snippet(setting: Setting, law: str = "qp") -> Trace:
    """Fly a setting under a law with geometric features; a setting flown before is remembered.

    Args:
        setting: Configuration, scene and seed.
        law: "qp" or "paper".

    Raises:
        ConfigError: When the configuration is refused, for example because the contact would ring.
    """
    job = SnippetJob(hold_s=unless_short(HOLD_S, SHORT_HOLD_S), slide_s=unless_short(SLIDE_S, SHORT_SLIDE_S))
    return _fly(setting.pilot, setting.scene, setting.seed, law, job)


@functools.lru_cache(maxsize=KEPT_FLIGHTS)
def _fly(pilot: PilotConfig, scene: Scene, seed: int, law: str, job: SnippetJob) -> Trace:
    options = FlightOptions(law=law, seed=seed, features="geometric", video=False)
    trace = fly(scene, options, config=pilot_config(scene, options, pilot), job=job)
    # Nobody looks at the board here; a trace that changes the process would draw it, and carry it along.
    trace.canvas = trace.coverage_mask = None
    return trace


def analytic_setting(setting: Setting, own_gains: bool = True) -> Setting:
    """What the analytic law flies beside a setting: the same scene, vehicle and contact settings.

    Args:
        setting: What the quadratic program flies.
        own_gains: Take the gains of the analytic law's own preset, tuned for it by the same search; else share them.
    """
    controller = setting.pilot.controller
    plain = default_preset("paper" if own_gains else "qp").controller
    gains = plain.gains if own_gains else controller.gains
    # Weights, soft limits and solver mean nothing to this law: the same flight whatever they are.
    controller = dataclasses.replace(
        controller, gains=gains, weights=plain.weights, limits=plain.limits, solver=plain.solver
    )
    return dataclasses.replace(setting, pilot=dataclasses.replace(setting.pilot, controller=controller, law="paper"))
