"""Layouts for viewers: `foxglove.json` is imported in Foxglove, `rerun_view` opens a log in Rerun."""

from pathlib import Path

FOLDER = Path(__file__).parent
FOXGLOVE = FOLDER / "foxglove.json"
