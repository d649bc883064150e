"""The experiments by name, in the order of the report; each is a file in ``specs``. This module imports nothing."""

NAMES = (
    "force-hold",
    "paint",
    "ablation",
    "noise-sweep",
    "saturation",
    "sloped-edge",
    "friction",
    "gust",
    "rotor-derate",
    "approach",
    "payload",
    "rates",
    "mismatch",
    "worlds",
    "rivals",
)
ALL = "all"
#: Laws and gains crossed; it has a page of its own (`sim.experiments.fair`).
FAIR = "fair"
