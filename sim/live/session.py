"""A flight that is changed, disturbed, rewound and forked, and repeated bit-identically from its session file."""

from __future__ import annotations

import dataclasses
import hashlib
import time
from dataclasses import dataclass
from typing import Any

from ibvs_qp.config.errors import ConfigError, shown
from ibvs_qp.config.settings import adjusted, from_dict
from ibvs_qp.config.solver import SOLVERS
from ibvs_qp.controller import HybridController
from ibvs_qp.flight_state import FlightState
from ibvs_qp.qp.problem import ProgramData
from sim.faults.kinds import KINDS
from sim.faults.rotors import RotorFault
from sim.flight.closed_loop import ClosedLoop
from sim.flight.options import ticks_in
from sim.flight.trace import Event
from sim.live.rows import KEPT_S, LiveLoop
from sim.live.session_file import Change, SessionFile, Start
from sim.live.snapshot import Blocks, WorldState

#: Time between snapshots [s].
SNAPSHOT_S = 1.0
#: Snapshots that are kept [-].
SNAPSHOTS = round(KEPT_S / SNAPSHOT_S) + 1
#: Settings of a "task" change.
TASK = ("push_n", "speed_m_s")


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
        offset: Ticks between the beginning of a second and the snapshot in it.
    """

    def __init__(self, start: Start, law: str, kind: type[ClosedLoop] = LiveLoop, offset: int = 0) -> None:
        self.loop = kind(start.scene, start.options(law), start.config(law), start.job)
        self.digest = hashlib.sha256()
        self._every, self._offset = ticks_in(SNAPSHOT_S, self.loop.pilot.config.controller.tick_s), offset
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

    def rewind(self, tick: int) -> int:
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
            del self._snapshots[:-SNAPSHOTS]

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


class Session:
    """The QP law, and the analytic law beside it, from one beginning with the same changes of the world.

    Attributes:
        start: Beginning.
        qp: The flight under the QP law; it alone is the session's.
        ghost: That of the analytic law; None without.
        changes: Changes so far, by rising tick.

    Args:
        start: Beginning.
        ghost: Whether a second vehicle flies under the analytic law.
        kind: Class of the loop of the QP law.
        changes: Changes to come.
    """

    def __init__(
        self, start: Start, ghost: bool = False, kind: type[ClosedLoop] = LiveLoop, changes: tuple[Change, ...] = ()
    ) -> None:
        self.start, self.qp = start, Flight(start, "qp", kind)
        half = ticks_in(0.5 * SNAPSHOT_S, self.qp.loop.pilot.config.controller.tick_s)
        self.ghost = Flight(start, "paper", offset=half) if ghost else None
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
        self.qp.step()
        if self.ghost is not None and self.ghost.going:
            self.ghost.step()

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
        return max(self.qp.first, self.ghost.first if self.ghost is not None else 0)

    def rewind(self, tick: int) -> None:
        """Go back to a tick of the last minute; changes from then on are dropped: the flight may go another way."""
        tick = min(max(tick, self.first), self.ticks)
        changes = [change for change in self.changes if change.tick < tick]
        for flight in (self.ghost, self.qp):
            if flight is None:
                continue
            begin = flight.rewind(tick)
            due = [change for change in changes if change.tick >= begin]
            while flight.loop.ticks < tick and flight.going:
                for change in [each for each in due if each.tick == flight.loop.ticks]:
                    flight.apply(change)
                flight.step()
        self.changes, self._next = changes, len(changes)

    def file(self) -> SessionFile:
        """The session so far."""
        changes = tuple(self.changes[: self._next])
        return SessionFile(start=self.start, changes=changes, ticks=self.ticks, digest=self.qp.digest.hexdigest())

    def close(self) -> None:
        """Close both flights."""
        for flight in (self.qp, self.ghost):
            if flight is not None:
                flight.loop.close()

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
