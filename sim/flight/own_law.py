"""The control law of a flight's options: a class of the user's, or the QP law with tasks and limits of the user's."""

from __future__ import annotations

import functools

from ibvs_qp.checked_law import CheckedLaw
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.controller import HybridController
from ibvs_qp.limits import Limit
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.tasks import Task
from sim.flight.jobs import Job
from sim.flight.options import FlightOptions
from sim.flight.own_class import built, described


def own_law(options: FlightOptions, config: ControllerConfig) -> CheckedLaw | None:
    """The control law of the options, or the QP law with their tasks and limits; None without any of them.

    Args:
        options: ``controller``, ``controller_settings`` and ``rows`` are read.
        config: Configuration of the law.

    Raises:
        ConfigError: When a class cannot be loaded or constructed, or rows are given for another law.
    """
    if options.rows and (options.controller or options.law != "qp"):
        raise ConfigError(f"rows {', '.join(options.rows)}: tasks and limits join the QP law only (laws = ['qp'])")
    if options.controller:
        settings = () if options.controller_settings is None else (options.controller_settings,)
        return built(options.controller, CheckedLaw, "controller", config, *settings)  # type: ignore[type-abstract]
    if not options.rows:
        return None
    rows = [built(name, (Task, Limit), "rows") for name in options.rows]  # type: ignore[type-abstract]
    tasks = [row for row in rows if isinstance(row, Task)]
    try:
        return HybridController(config, tasks=tasks, limits=[row for row in rows if isinstance(row, Limit)])
    except ConfigError:
        raise
    except Exception as error:  # of the user's rows
        raise ConfigError(f"rows {', '.join(options.rows)}: {described(error)}") from error


def check_own(options: FlightOptions, config: PilotConfig, job: Job | None) -> None:
    """Construct the user's classes of a flight, those of a law once in a process.

    Raises:
        ConfigError: When one of them cannot be loaded or constructed.
    """
    _construct(options.controller, options.rows, options.law, config.controller)
    if job is not None:
        job.strategy(config.painting)


@functools.lru_cache(maxsize=64)
def _construct(controller: str, rows: tuple[str, ...], law: str, config: ControllerConfig) -> None:
    own_law(FlightOptions(controller=controller, rows=rows, law=law), config)
