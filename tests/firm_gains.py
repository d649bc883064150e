"""Gains of the search before the shipped ones: firmer in attitude and yaw, where a mechanism must show itself."""

from pathlib import Path

from ibvs_qp.pilot import PilotConfig

ROOT = Path(__file__).parents[1]
FIRM = PilotConfig.from_toml(ROOT / "docs" / "tuning" / "start_qp.toml").controller.gains
