"""The only file of the replay that reads what `ibvs_qp` does not export; a rename inside it is answered here."""

from __future__ import annotations

from typing import Any

import numpy as np

from ibvs_qp import FeatureFrame, Measurement, Pilot, Reference
from ibvs_qp.pilot.painting.presser import Presser


def program(controller: Any) -> dict[str, np.ndarray] | None:
    """P, q, A, l, u of the last tick in full, or None under a law without a program.

    The order of variables and rows is that of the recordings; another order inside has to be undone here.
    """
    engine = getattr(controller, "engine", None)
    if engine is None:
        return None
    data = engine.data
    copies = {"q": data.q.copy(), "l": data.lower.copy(), "u": data.upper.copy()}
    return {"P": data.hessian(), "A": data.rows()} | copies


def perceived(pilot: Pilot) -> FeatureFrame | None:
    """Lines, plane and velocity that vision found in the last picture, or None before the first."""
    return None if pilot.perception_result is None else pilot.perception_result.features


def controller_inputs(pilot: Pilot) -> tuple[Measurement, Reference]:
    """Measurement and reference that the pilot passed to its controller at the last tick."""
    assert pilot.measurement is not None
    return pilot.measurement, pilot.reference


def pressing_strategy(painting: Any, hold_s: float, descend_s: float) -> Any:
    """Strategy that presses for a time and descends after a lost rotor; `painting` is that of a PilotConfig."""
    return Presser(painting, hold_s, 0.0, descend_s)
