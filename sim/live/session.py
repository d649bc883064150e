"""A flight that is changed, disturbed, rewound and forked, and repeated bit-identically from its session file."""

from __future__ import annotations

import dataclasses
import hashlib
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ibvs_qp.config.errors import ConfigError, out_of_range, shown
from ibvs_qp.config.settings import adjusted, dump_toml, from_dict
from ibvs_qp.config.solver import SOLVERS
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.controller import HybridController
from ibvs_qp.flight_state import FlightState
from ibvs_qp.frames import GRAVITY
from ibvs_qp.qp.problem import ProgramData
from sim.faults.kinds import KINDS
from sim.faults.rotors import RotorFault
from sim.flight.closed_loop import ClosedLoop
from sim.flight.flight_log import save_log
from sim.flight.options import ticks_in
from sim.flight.trace import Event
from sim.live.rows import KEPT_S, LiveLoop
from sim.live.session_file import Change, SessionFile, Start
from sim.live.snapshot import Blocks, WorldState
from sim.storage.atomic import write_text

#: Time between snapshots [s].
SNAPSHOT_S = 1.0
#: Snapshots that are kept [-].
SNAPSHOTS = round(KEPT_S / SNAPSHOT_S) + 1
#: Settings of a "task" change.
TASK = ("push_n", "speed_m_s")
#: Setting of a "thrust" change: upper limit of all rotors [N]; limits that differ by less are equal [N].
CEILING, ROUNDING_N = "thrust_max_n", 1e-9


def ceilings(vehicle: VehicleParams) -> tuple[float, float]:
    """Smallest and largest upper thrust limit of a session [N]: the mean thrust of a hover, and full thrust."""
    return vehicle.mass_kg * GRAVITY / vehicle.geometry.count, float(vehicle.thrust_max.max())


@dataclass
class Snapshot:
    """State of one flight after some ticks."""

    ticks: int
    pilot: FlightState
    world: WorldState
    command: Any
    reason: str
    solver: str
    digest: Any
    events: list[Event]


class Flight:
    """One law of a session, with the snapshots of its last minute.

    Attributes:
        loop: The flight.
        solver: Name of the solver in use.
        digest: Hash of commands and truth of all its ticks.

    Args:
        start: Beginning of the session.
        law: The law.
        kind: Class of the loop.
        offset: Time between the beginning of a second and the snapshot in it [s].
        kept: Snapshots that are kept [-].
    """

    def __init__(
        self, start: Start, law: str, kind: type[ClosedLoop] = LiveLoop, offset: float = 0.0, kept: int = SNAPSHOTS
    ) -> None:
        self.loop = kind(start.scene, start.options(law), start.config(law), start.job)
        self.digest = hashlib.sha256()
        tick_s, self._kept = self.loop.pilot.config.controller.tick_s, kept
        self._every, self._offset = ticks_in(SNAPSHOT_S, tick_s), ticks_in(offset, tick_s)
        self._snapshots: list[Snapshot] = []
        self._blocks, self.solver = Blocks(), self.loop.pilot.config.controller.solver.name
        self._keep()

    @property
    def going(self) -> bool:
        """Whether a further tick belongs to the flight."""
        return self.loop.going

    def step(self) -> None:
        """Fly a tick."""
        loop = self.loop
        loop.sense()
        loop.advance()
        assert loop.command is not None
        self.digest.update(loop.command.thrusts.tobytes())
        self.digest.update(loop.world.plant.truth.tobytes())
        if loop.ticks % self._every == self._offset:
            self._keep()

    def apply(self, change: Change) -> None:
        """Apply a change before the next tick.

        Raises:
            ConfigError: When it is refused; nothing is changed then.
        """
        pilot, values = self.loop.pilot, change.values
        if change.kind == "set":
            solver = values.get("solver.name")
            others = {name: value for name, value in values.items() if name != "solver.name"}
            if isinstance(pilot.controller, HybridController):
                engine = None if solver is None else self._engine(solver)
                pilot.controller.adjust(others)  # type: ignore[attr-defined]
                if solver is not None:
                    self._use(engine, solver)
        elif change.kind == "task":
            if wrong := values.keys() - set(TASK):
                raise ConfigError(f"{', '.join(sorted(wrong))}: not one of {', '.join(TASK)}")
            adjusted(pilot.config, "painting", values)
            pilot.painter.adjust(**values)
        elif change.kind == "thrust":
            self._limit_thrusts(values)
        elif change.kind == "fault":
            own = dict(values)
            kind = own.pop("kind", None)
            if not isinstance(kind, str) or kind not in KINDS:
                raise ConfigError(f"unknown kind of fault {shown(kind)}; known kinds: {', '.join(KINDS)}")
            fault, names = from_dict(KINDS[kind], own, kind), pilot.config.controller.vehicle.geometry.names
            if isinstance(fault, RotorFault) and fault.rotor not in ("", *names):
                raise ConfigError(f"unknown rotor {shown(fault.rotor)}; known rotors: {', '.join(names)}")
            self.loop.disturb(dataclasses.replace(fault, after="start", delay_s=0.0))
        else:
            raise ConfigError(f"unknown kind of change {change.kind!r}")

    def _limit_thrusts(self, values: dict[str, Any]) -> None:
        """Upper thrust limit of rotor and controller; a lost or weak rotor keeps its own, lower one."""
        plant, vehicle, limit = self.loop.world.plant, self.loop.pilot.config.controller.vehicle, values.get(CEILING)
        if values.keys() != {CEILING} or isinstance(limit, bool) or not isinstance(limit, (int, float)):
            raise ConfigError(f"a change of kind 'thrust' has one number, {CEILING}, not {shown(values)}")
        least, most = ceilings(vehicle)
        if not least <= limit <= most:  # nor NaN
            raise out_of_range(CEILING, limit, "N", f"allowed is {least:.4g} to {most:.4g} N")
        (lower, upper), own = plant.thrust_limits, plant.vehicle.thrust_max
        sound = upper >= np.minimum(own, upper.max()) - ROUNDING_N
        plant.thrust_limits = lower, np.minimum(np.where(sound, own, upper), limit)
        self.loop.pilot.thrust_limits = plant.thrust_limits

    def back(self, tick: int, changes: list[Change]) -> None:
        """Go back to a tick: continue from the newest snapshot before it, with the changes of the session."""
        begin = self._restore(tick)
        due = [change for change in changes if change.tick >= begin]
        while self.loop.ticks < tick and self.going:
            for change in [each for each in due if each.tick == self.loop.ticks]:
                self.apply(change)
            self.step()

    def close(self) -> None:
        """End the flight."""
        self.loop.close()

    def _restore(self, tick: int) -> int:
        """Continue from the newest snapshot up to a tick; returns its tick, which may be earlier."""
        kept = [each for each in self._snapshots if each.ticks <= tick] or self._snapshots[:1]
        self._snapshots, found, loop = kept, kept[-1], self.loop
        if self.solver != found.solver:
            self._use(self._engine(found.solver), found.solver)
        loop.pilot.restore(found.pilot)
        found.world.restore()
        loop.command, loop.reason, loop.ticks = found.command, found.reason, found.ticks
        self.digest = found.digest.copy()
        if isinstance(loop, LiveLoop):
            loop.recorder.back_to(found.ticks, list(found.events))
        return found.ticks

    def _keep(self) -> None:
        """Take a snapshot: the solver sets up anew, so the flight of a session file takes the same ones."""
        loop = self.loop
        pilot = loop.pilot.state()
        if isinstance(loop, LiveLoop):
            events, roots = list(loop.recorder.events), (loop.world, loop._schedule, loop.pilot._seen_as)
            world = WorldState(roots, (loop.pilot,), self._blocks)
            self._snapshots.append(
                Snapshot(loop.ticks, pilot, world, loop.command, loop.reason, self.solver, self.digest.copy(), events)
            )
            del self._snapshots[: -self._kept]

    @property
    def first(self) -> int:
        """Earliest tick that can be rewound to."""
        return self._snapshots[0].ticks if self._snapshots else self.loop.ticks

    def _engine(self, name: str) -> Any:
        law = self.loop.pilot.controller
        assert isinstance(law, HybridController)
        if name not in SOLVERS:
            raise ConfigError(f"unknown solver.name {shown(name)}; known: {', '.join(SOLVERS)}")
        backend = law.config.solver.backend if name == "osqp" else "python"
        solver = dataclasses.replace(law.config.solver, backend="python")
        solver = dataclasses.replace(dataclasses.replace(solver, name=name), backend=backend)
        try:
            return law.engine_kind(law.problem, solver, ProgramData(law.problem, law.setpoints.step))
        except ImportError as error:
            raise ConfigError(f"solver.name = {name!r}: {error.name} is not installed, of the extra solvers") from None

    def _use(self, engine: Any, name: str) -> None:
        law = self.loop.pilot.controller
        assert isinstance(law, HybridController)
        law.engine, self.solver = engine, name
        engine.reset()


def ghost_flight(start: Start) -> Flight:
    """The analytic law; its snapshots are between those of the QP law, and reach further back."""
    return Flight(start, "paper", offset=0.5 * SNAPSHOT_S, kept=SNAPSHOTS + 1)


class Follower(Protocol):
    """A flight beside that of a session, see `Flight`."""

    def step(self) -> None:
        """Fly a tick."""

    def apply(self, change: Change) -> None:
        """Apply a change before the next tick."""

    def back(self, tick: int, changes: list[Change]) -> None:
        """Go back to a tick."""

    def close(self) -> None:
        """End it."""


class Session:
    """The QP law, and the analytic law beside it, from one beginning with the same changes of the world.

    Attributes:
        start: Beginning.
        qp: The flight under the QP law; it alone is the session's.
        ghost: That of the analytic law; None without.
        changes: Changes so far, by rising tick.

    Args:
        start: Beginning.
        ghost: Flight of the analytic law.
        kind: Class of the loop of the QP law.
        changes: Changes to come.
    """

    def __init__(
        self,
        start: Start,
        ghost: Follower | None = None,
        kind: type[ClosedLoop] = LiveLoop,
        changes: tuple[Change, ...] = (),
    ) -> None:
        self.start, self.qp, self.ghost = start, Flight(start, "qp", kind), ghost
        self.changes, self._next = list(changes), 0

    @property
    def ticks(self) -> int:
        """Ticks flown."""
        return self.qp.loop.ticks

    @property
    def going(self) -> bool:
        """Whether a further tick belongs to the flight."""
        return self.qp.going

    def step(self) -> None:
        """Fly a tick."""
        self._apply_due()
        if isinstance(self.qp.loop, LiveLoop):
            self.qp.loop.recorder.wall_s = time.monotonic()
        if self.ghost is not None:
            self.ghost.step()
        self.qp.step()

    def change(self, kind: str, values: dict[str, Any]) -> Change:
        """Change something before the next tick.

        Raises:
            ConfigError: When it is refused; nothing is changed then.
        """
        self._apply_due()
        change = Change(tick=self.ticks, kind=kind, values=values)
        self._apply(change)
        del self.changes[self._next :]
        self.changes.append(change)
        self._next = len(self.changes)
        return change

    @property
    def first(self) -> int:
        """Earliest tick that can be rewound to."""
        return self.qp.first

    def rewind(self, tick: int) -> None:
        """Go back to a tick of the last minute; changes from then on are dropped: the flight may go another way."""
        tick = min(max(tick, self.first), self.ticks)
        changes = [change for change in self.changes if change.tick < tick]
        for flight in (self.ghost, self.qp):
            if flight is not None:
                flight.back(tick, changes)
        self.changes, self._next = changes, len(changes)

    def file(self) -> SessionFile:
        """The session so far."""
        changes = tuple(self.changes[: self._next])
        return SessionFile(start=self.start, changes=changes, ticks=self.ticks, digest=self.qp.digest.hexdigest())

    def close(self) -> None:
        """Close both flights."""
        for flight in (self.qp, self.ghost):
            if flight is not None:
                flight.close()

    def _apply_due(self) -> None:
        while self._next < len(self.changes) and self.changes[self._next].tick <= self.ticks:
            self._apply(self.changes[self._next])
            self._next += 1

    def _apply(self, change: Change) -> None:
        self.qp.apply(change)
        if self.ghost is not None:
            self.ghost.apply(change)


def repeat(file: SessionFile, kind: type[ClosedLoop] = LiveLoop) -> Session:
    """Fly a session file again, without a browser; compare `Session.file` with it.

    Args:
        file: The session.
        kind: Class of the loop; `ClosedLoop` keeps the whole log.
    """
    session = Session(file.start, kind=kind, changes=file.changes)
    while session.ticks < file.ticks and session.going:
        session.step()
    return session


def write_run(folder: Path, session: Session) -> None:
    """Write scene and log of a session that was flown with the whole log.

    Raises:
        UnwritableFile: When the system does not let it.
    """
    trace = session.qp.loop.trace()
    write_text(folder / "scene.toml", dump_toml(trace.scene))
    save_log(folder / "log.npz", {"qp": trace})
