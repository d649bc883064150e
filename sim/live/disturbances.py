"""Disturbances by button: faults of the fault matrix, at the next tick."""

from __future__ import annotations

from typing import Any

from ibvs_qp.frames import GRAVITY

#: Mass of the payload [kg]; its weight acts at the centre of mass.
PAYLOAD_KG = 0.3
#: Front of a gust [s]: the 1.4 m of the vehicle at 5 m/s.
_FRONT_S = 0.28

#: Faults by label, each as kind and settings; those of rotors get the name of the chosen one.
BUTTONS: dict[str, tuple[dict[str, Any], ...]] = {
    "Gust 5 m/s, 1 s": ({"kind": "WindStep", "mean_m_s": [0.0, 5.0, 0.0], "rise_s": _FRONT_S, "duration_s": 1.0},),
    "Wind 4 m/s": ({"kind": "WindStep", "mean_m_s": [4.0, 0.0, 0.0], "rise_s": _FRONT_S},),
    "Push 10 N, 1 s": ({"kind": "SidePush", "force_n": [0.0, 10.0, 0.0], "duration_s": 1.0},),
    f"Payload {PAYLOAD_KG:g} kg": ({"kind": "SidePush", "force_n": [0.0, 0.0, PAYLOAD_KG * GRAVITY]},),
    "Friction 0.8": ({"kind": "OtherWall", "friction": 0.8},),
    "Stiffness x 5": ({"kind": "OtherWall", "stiffness_ratio": 5.0},),
    "Wall removed": ({"kind": "BoardMoved", "away_m": 1.0}, {"kind": "LinesLost"}),
    "Camera dark, 2 s": ({"kind": "CameraLost", "duration_s": 2.0},),
    "F/T drift": ({"kind": "ForceTorqueBias"},),
    "Rotor lost": ({"kind": "Derate", "share": 0.0},),
    "Rotor weak, 50 %": ({"kind": "Derate", "share": 0.5},),
}
#: Labels of those that hit one rotor.
OF_ROTOR = ("Rotor lost", "Rotor weak, 50 %")


def faults(label: str, rotor: str) -> list[dict[str, Any]]:
    """Values of the changes of kind "fault" of a button."""
    return [dict(each) | ({"rotor": rotor} if label in OF_ROTOR else {}) for each in BUTTONS[label]]
