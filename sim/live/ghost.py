"""The analytic law in a process of its own: both laws in one leave no time in a tick for snapshots and frames."""

from __future__ import annotations

import contextlib
import gc
import signal
from collections.abc import MutableSequence, Sequence
from multiprocessing.connection import Connection

import numpy as np

from ibvs_qp.config.errors import ConfigError, IbvsQpError
from sim.live.rows import LiveLoop
from sim.live.session import ghost_flight
from sim.live.session_file import Change, Start

#: The QP law waits for a ghost that is behind by more than this [ticks].
BEHIND_TICKS = 25
#: Shared numbers: ticks flown, position [m] and attitude (w, x, y, z) of the body.
SHARED = 1 + 3 + 4


class Ghost:
    """The analytic law beside a session: ticks and changes are sent, and its process executes them in this order.

    Args:
        connection: To its process.
        shared: Numbers that it writes, (`SHARED`,).

    Raises:
        ConfigError: When it cannot fly.
    """

    def __init__(self, connection: Connection, shared: Sequence[float]) -> None:
        self._connection, self._shared, self._ticks = connection, shared, 0
        if error := connection.recv():
            raise ConfigError(error)

    def step(self) -> None:
        """Fly a tick."""
        self._ticks += 1
        self._connection.send(("step",))
        while self._ticks - self._shared[0] > BEHIND_TICKS:
            if self._connection.poll(1e-3):  # it sends nothing: its process has ended
                raise EOFError

    def apply(self, change: Change) -> None:
        """Apply a change that the QP law has taken."""
        self._connection.send(("apply", change))

    def back(self, tick: int, changes: list[Change]) -> None:
        """Go back to a tick."""
        self._ticks = tick
        self._connection.send(("back", tick, changes))

    def close(self) -> None:
        """End its process."""
        self._connection.close()

    @property
    def pose(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Position, world NED [m], and attitude; None before its first tick."""
        shared = np.array(self._shared)
        return (shared[1:4], shared[4:]) if shared[0] else None


def follow(connection: Connection, start: Start, shared: MutableSequence[float]) -> None:
    """Main function of the process; it ends with its connection."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        flight = ghost_flight(start)
    except IbvsQpError as error:
        connection.send(str(error))
        return
    connection.send("")
    gc.disable()  # as in the process of the QP law
    loop = flight.loop
    assert isinstance(loop, LiveLoop)
    places = loop.recorder.places
    with contextlib.suppress(EOFError, ConnectionError):
        while True:
            name, *values = connection.recv()
            if name != "step" or flight.going:
                getattr(flight, name)(*values)
                row = loop.recorder.rows(loop.ticks - 1, loop.ticks).reshape(-1)
                if len(row):
                    shared[:] = [float(loop.ticks), *row[places["position"]], *row[places["quaternion"]]]
            else:
                shared[0] += 1.0  # it has landed, and waits
    flight.close()
