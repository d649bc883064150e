"""Facts of a log about its controller, from which it is built again."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any

from ibvs_qp.analytic import PaperController
from ibvs_qp.checked_law import CheckedLaw
from ibvs_qp.config import ControllerConfig, SafetySettings
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.files import parse_toml
from ibvs_qp.config.settings import dump_toml, from_dict
from ibvs_qp.controller import HybridController
from ibvs_qp.estimation.turned_camera import straightened
from ibvs_qp.pilot import Pilot, PilotConfig
from ibvs_qp.supervision.assured import Assured

#: Version of topics and messages that replay needs; another one is refused.
FORMAT = "1"
LAWS: dict[str, type[CheckedLaw]] = {"qp": HybridController, "paper": PaperController}
PILOT, ASSURED, CONTROLLER = "pilot", "assured", "controller"
#: Packages whose arithmetic is in the commands.
_PACKAGES = ("numpy", "casadi", "osqp")


def header(flown: Pilot | Assured | CheckedLaw) -> dict[str, str]:
    """Facts of the metadata record."""
    law: Any = flown if isinstance(flown, CheckedLaw) else flown.controller
    kind = PILOT if isinstance(flown, Pilot) else ASSURED if isinstance(flown, Assured) else CONTROLLER
    config = dump_toml(flown.config if isinstance(flown, Pilot) else law.config, derived=True)
    shipped = next((name for name, kind in LAWS.items() if type(law) is kind), "")
    return {
        "format": FORMAT,
        "version": version("ibvs-qp"),
        "kind": kind,
        "law": shipped or f"{type(law).__module__}.{type(law).__qualname__}",
        "config": config,
        "config_sha256": digest(config),
        "safety": dump_toml(flown.supervision.settings) if isinstance(flown, Assured) else "",
        "rows": _rows(law),
        "machine": f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
        "packages": ", ".join(f"{name} {version(name)}" for name in _PACKAGES),
        "started_utc": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def digest(config: str) -> str:
    """SHA-256 of a configuration's text."""
    return hashlib.sha256(config.encode()).hexdigest()


def _rows(law: Any) -> str:
    """Names of the program's rows of tasks and limits; empty under a law without a program."""
    problem = getattr(law, "problem", None)
    return "" if problem is None else ",".join((*(row.name for row in problem.task_rows), *problem.row_names))


def recorded_controller(facts: Mapping[str, str]) -> CheckedLaw | Assured:
    """The controller of a log, as before its first tick.

    Raises:
        ConfigError: When only the code of the flight can build it.
    """
    if facts["law"] not in LAWS:
        raise ConfigError(f"flown by a law of its own, {facts['law']}; replay it from Python with that controller")
    kind = PilotConfig if facts["kind"] == PILOT else ControllerConfig
    config = from_dict(kind, parse_toml(facts["config"], "the log's configuration"))
    law = LAWS[facts["law"]](straightened(config.controller) if isinstance(config, PilotConfig) else config)  # type: ignore[abstract]
    if _rows(law) != facts["rows"]:
        raise ConfigError("flown with tasks or limits of its own; replay it from Python with that controller")
    if facts["kind"] != ASSURED:
        return law
    return Assured(law, from_dict(SafetySettings, parse_toml(facts["safety"], "the log's safety settings")))
