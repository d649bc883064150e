"""Pictures of the documentation, from the code that they show: ``python docs/draw [NAME ...]`` writes docs/pictures.

Only by its name, since it needs playwright and chromium: ``python docs/draw live`` writes docs/images/tuning.webp.
"""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import matplotlib
from diagrams import solvers, supervisor, tick
from job import contact, estimation, model, painting, vision
from vehicle import allocation, frames, simulation

FOLDER = Path(__file__).parents[1] / "pictures"
PICTURES = {
    "tick": tick, "qp": solvers, "safety": supervisor, "frames": frames, "allocation": allocation, "painting": painting,
    "contact": contact, "simulation": simulation, "model": model, "estimation": estimation,
}  # fmt: skip
#: Quality of the photograph-like picture [%].
JPEG_QUALITY = 85

names = sys.argv[1:] or [*PICTURES, "vision"]
with matplotlib.rc_context({"svg.hashsalt": "ibvs_qp", "font.size": 9}):  # the same bytes every time
    for name in names:
        if name in PICTURES:
            PICTURES[name]().savefig(FOLDER / f"{name}.svg", metadata={"Date": None}, facecolor="white")
if "vision" in names:
    cv2.imwrite(str(FOLDER / "vision.jpg"), vision()[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
if "live" in names:
    from live import RATE_HZ, live

    from sim.video.animation import write_webp

    write_webp(live(), FOLDER.parent / "images" / "tuning.webp", RATE_HZ)
