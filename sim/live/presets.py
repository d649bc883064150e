"""A preset of the changes alone: every key that differs from the default of its field."""

from __future__ import annotations

from typing import Any

from ibvs_qp.config.settings import to_dict
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.pilot.painting.config import PaintingConfig

_HEAD = "# Changes against the shipped preset; every other value has its default."


def changed_keys(table: dict[str, Any], base: dict[str, Any]) -> dict[str, Any]:
    """Keys of a table whose values differ from another's, section by section."""
    changed: dict[str, Any] = {}
    for name, value in table.items():
        if isinstance(value, dict) and isinstance(base.get(name), dict):
            if inner := changed_keys(value, base[name]):
                changed[name] = inner
        elif value != base.get(name):
            changed[name] = value
    return changed


def changes_text(config: PilotConfig, task: PaintingConfig) -> str:
    """The configuration as TOML with only its changes; `PilotConfig.from_toml` reads it.

    Args:
        config: The configuration.
        task: The paint job flown: its push and speed belong to the scene, and stand in comments.
    """
    import tomli_w

    base = to_dict(PilotConfig(law=config.law), derived=True)
    table = changed_keys(to_dict(config), base)
    for name in ("painting", "vision"):  # follow from the scene
        table.pop(name, None)
    controller = table.get("controller", {})
    for section in ("vehicle", "solver"):  # calibration of the scene's camera; the machine's backend
        calibrated = {"camera_size_px", "camera_intrinsics_px", "backend"}
        kept = {name: value for name, value in controller.pop(section, {}).items() if name not in calibrated}
        if kept:
            controller[section] = kept
    if not controller:
        table.pop("controller", None)
    job = f"# The scene's [paint]: push_n = {task.push_n:g}, speed_m_s = {task.speed_m_s:g}"
    return "\n".join([_HEAD, job, "", tomli_w.dumps(table)])
