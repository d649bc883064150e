"""``ibvs-qp live``: the flight in the browser, tuned while it flies; and a session flown again without one."""

from __future__ import annotations

import contextlib
import dataclasses
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from ibvs_qp.config.errors import ConfigError
from sim.commands.exit_codes import EXIT_INTERNAL
from sim.commands.options import SceneWorld, check_mujoco, check_seed, flag, optional, preset_file, scene_file

#: Ports for a server without privileges [-].
_PORTS = 1024, 65535

if TYPE_CHECKING:
    from sim.live.session_file import Start


@dataclasses.dataclass(frozen=True, kw_only=True)
class Live:
    """Fly in the browser: change weights and limits, disturb, pause, rewind, fork and explain while it flies.

    Example: ibvs-qp live --scene dark_board --seed 3

    Example: ibvs-qp live --replay runs/live/2026-11-30T10-00-00-1/session.json
    """

    scene: Annotated[Path | None, optional("FILE")] = None
    """Scene file (TOML), or a shipped scene as dark_board; default: a C of two rows."""
    world: SceneWorld = None
    preset: Annotated[Path | None, optional("FILE")] = None
    """Preset file (TOML) of the QP law, or a shipped one as octorotor_qp; default: the law's."""
    features: Literal["geometric", "rendered"] = "geometric"
    """Perception: a sensor model of lines, or rendered pictures through the vision pipeline."""
    seed: int = 0
    """Varies start pose, textures, noise and biases; the same seed repeats the flight."""
    press: Annotated[float | None, optional("S")] = None
    """Press at one place for this long [s], instead of the scene's paint job."""
    no_ghost: Annotated[bool, flag] = False
    """Do not fly the analytic law beside the QP law."""
    replay: Annotated[Path | None, optional("FILE")] = None
    """Session file: fly it again without a browser and compare every bit; --out writes its log."""
    log: Annotated[Path | None, optional("FILE")] = None
    """Show a log instead of a flight: a run folder, or an MCAP log of your own loop, of a bag or of paint."""
    out: Annotated[Path | None, optional("DIR")] = None
    """Folder of saved files; default: runs/live. With --replay: run folder of the log; default: none."""
    host: str = "127.0.0.1"
    """Address to listen on; another one than loopback lets everyone who reaches it take the controls."""
    port: int = 8080
    """Port to listen on."""
    no_open: Annotated[bool, flag] = False
    """Print the address, and do not open a browser."""
    json: Annotated[bool, flag] = False
    """With --replay: print the result as JSON."""

    def run(self, words: list[str]) -> int:
        """Serve until Ctrl-C; or fly a session again."""
        check_mujoco()
        if self.replay is not None:
            return self._replay(words)
        check_seed(self.seed)
        if not _PORTS[0] <= self.port <= _PORTS[1]:
            raise ConfigError(f"--port {self.port} is refused: allowed is {_PORTS[0]} to {_PORTS[1]}")
        if self.json:
            raise ConfigError("--json is of --replay")
        if self.log is not None and not self.log.exists():
            raise ConfigError(f"--log {self.log}: no such file")
        try:
            import viser  # noqa: F401
        except ModuleNotFoundError:
            raise ConfigError("live needs the extra live: pip install -c constraints.txt -e '.[live]'") from None
        from rich.console import Console

        from sim.flight.working import working

        text = "Preparing the page; the first start compiles the programs, and takes about a minute ..."
        with contextlib.ExitStack() as waiting:  # a terminal has the line at once, a file none
            waiting.enter_context(working(Console(stderr=True, quiet=not sys.stderr.isatty()), text))
            return self._serve(waiting)

    def _serve(self, waiting: contextlib.ExitStack) -> int:
        """Serve until Ctrl-C; `waiting` is closed once the page is ready."""
        from sim.live.server import FlightEnded, LiveServer
        from sim.live.site import open_server

        def ready(address: str) -> None:
            waiting.close()
            print(f"ibvs-qp live: {address} (Ctrl-C ends it)", flush=True)

        if self.log is not None:
            from sim.live.log_scene import LoggedFlight, LogServer

            flight = LoggedFlight(self.log)
            if flight.note:
                print(f"ibvs-qp live: {flight.note}", file=sys.stderr)
            LogServer(flight, open_server(self.host, self.port)).run(not self.no_open, ready)
            return 0
        start = self._start()
        server = open_server(self.host, self.port)
        try:
            LiveServer(start, server, self.out or Path("runs/live"), not self.no_ghost).run(not self.no_open, ready)
        except FlightEnded as error:
            print(f"ibvs-qp: {error}", file=sys.stderr)
            return EXIT_INTERNAL
        return 0

    def _start(self) -> Start:
        """Beginning of the session; an unusable scene, preset or job is refused."""
        import ibvs_qp
        from ibvs_qp.pilot import PilotConfig
        from sim.flight.jobs import PressJob
        from sim.flight.options import pilot_config
        from sim.flight.preflight import check_job
        from sim.live.session_file import Start
        from sim.world.worlds import scene_in_world

        chosen, preset = scene_file(self.scene), preset_file(self.preset)
        scene, _ = scene_in_world(chosen, self.world)
        config = ibvs_qp.preset("qp") if preset is None else PilotConfig.from_toml(preset)
        if config.law != "qp":
            raise ConfigError(f"--preset {self.preset} is of the analytic law; live tunes the QP law")
        try:
            press = None if self.press is None else PressJob(hold_s=self.press)
        except ConfigError as error:
            raise ConfigError(str(error).replace("hold_s", "--press")) from None
        start = Start(scene=scene, preset=config, seed=self.seed, features=self.features, press=press)
        flown = pilot_config(scene, start.options("qp"), config)
        check_job(scene, flown, self.features, None if press is None else press)
        return start

    def _replay(self, words: list[str]) -> int:
        """Fly a session file again."""
        from rich.console import Console

        from sim.flight.closed_loop import ClosedLoop
        from sim.flight.working import working
        from sim.live.rows import LiveLoop
        from sim.live.session import repeat, write_run
        from sim.live.session_file import SessionFile
        from sim.report.rundir import as_json

        assert self.replay is not None
        file, notes = SessionFile.read(self.replay), Console(stderr=True, quiet=self.json)
        with working(notes, f"Flying {file.ticks} ticks again ..."):
            session = repeat(file, LiveLoop if self.out is None else ClosedLoop)
        again = session.file()
        if self.out is not None:
            write_run(self.out, session)
        session.close()
        same = (again.ticks, again.digest) == (file.ticks, file.digest)
        if not same:
            raise ConfigError(f"{self.replay}: the flight is another one after {again.ticks} of {file.ticks} ticks")
        if self.json:
            print(as_json({"schema": 1, "ticks": file.ticks, "changes": len(file.changes), "identical": True}))
        else:
            print(f"{file.ticks} ticks and {len(file.changes)} change{'s' * (len(file.changes) != 1)}: bit-identical")
        return 0
