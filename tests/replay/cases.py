"""The flights: configuration and strategy of the pilot that flies and replays them."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ibvs_qp import HybridController, PaperController, Pilot, PilotConfig, SafetySettings
from ibvs_qp.pilot.presets import FOLDER

from . import internals

DATA = Path(__file__).parent / "data"
#: Colour of the paint, RGB, as in the default scene.
PAINT_COLOR = (40, 90, 200)
#: Calibration of the recorded pictures.
SMALL_CAMERA: dict[str, Any] = {
    "camera_size_px": (424, 240),
    "camera_intrinsics_px": (312.61, 312.61, 211.5, 119.5),
}


@dataclass(frozen=True, kw_only=True)
class Case:
    """One flight.

    Attributes:
        preset: Name of the shipped preset.
        flight_s: Length of the recording [s].
        pictures: Whether the camera is simulated; geometric features otherwise.
        perception: Vision pipeline, "own" or "paper".
        push_n: Wanted push [N].
        hold_s: Press for this long instead of painting [s].
        reach_check: Whether a push beyond the reach is reduced.
        inputs_of: Case whose recording is replayed with broken fields (`broken.py`); the flight's own otherwise.
    """

    preset: str = "tarot_t960_qp"
    flight_s: float
    pictures: bool = False
    perception: str = "own"
    push_n: float = 5.0
    hold_s: float | None = None
    reach_check: bool = True
    inputs_of: str | None = None

    def config(self) -> PilotConfig:
        """The preset with what the case changes; replayed sensors do not answer the thrusts, so nothing supervises."""
        preset = PilotConfig.from_toml(FOLDER / f"{self.preset}.toml")
        vehicle = dataclasses.replace(preset.controller.vehicle, **(SMALL_CAMERA if self.pictures else {}))
        return dataclasses.replace(
            preset,
            controller=dataclasses.replace(preset.controller, vehicle=vehicle, reach_check=self.reach_check),
            painting=dataclasses.replace(preset.painting, push_n=self.push_n),
            vision=dataclasses.replace(preset.vision, paint_color=PAINT_COLOR),
            perception=self.perception,
            safety=SafetySettings(supervise=False),
        )

    def pilot(self) -> Pilot:
        """A new pilot, ready for what the case shows it."""
        config = self.config()
        painter = None
        if self.hold_s is not None:
            painter = internals.pressing_strategy(config.painting, self.hold_s, descend_s=5.0)
        pilot = Pilot(config, painter)
        if self.pictures:
            pilot.prepare()
        return pilot

    def controller(self) -> HybridController | PaperController:
        """A new controller."""
        config = self.config()
        law = HybridController if config.law == "qp" else PaperController
        return law(config.controller)


CASES = {
    "paint_qp": Case(flight_s=7.2, pictures=True),
    "paint_paper_law": Case(preset="tarot_t960_paper", flight_s=8.0),
    "press_beyond_reach": Case(flight_s=7.2, push_n=35.0, hold_s=8.0, reach_check=False),
    "rotor_loss": Case(flight_s=7.2, hold_s=8.0),
    "heavy_noise": Case(flight_s=11.2),
    "paper_vision": Case(flight_s=4.0, pictures=True, perception="paper"),
    "octorotor": Case(preset="octorotor_qp", flight_s=7.0),
    "broken_inputs": Case(flight_s=7.2, hold_s=8.0, inputs_of="rotor_loss"),
}
