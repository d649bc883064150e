"""The log of a session that was flown again: a run folder that `ibvs-qp explain` and `live --log` read."""

from __future__ import annotations

from pathlib import Path

from ibvs_qp.config.settings import dump_toml
from sim.flight.flight_log import save_log
from sim.live.session import Session
from sim.storage.atomic import write_text


def write_run(folder: Path, session: Session) -> None:
    """Write scene and log of a session that was flown with the whole log.

    Raises:
        UnwritableFile: When the system does not let it.
    """
    trace = session.qp.loop.trace()
    write_text(folder / "scene.toml", dump_toml(trace.scene))
    save_log(folder / "log.npz", {"qp": trace})
