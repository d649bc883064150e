"""``ibvs-qp paint``: fly the paint job of a scene under one law or both, and write a report."""

from __future__ import annotations

import dataclasses
import importlib
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from sim.commands.exit_codes import EXIT_INTERRUPTED
from sim.commands.options import (
    SceneWorld,
    check_mujoco,
    check_seed,
    command_line,
    flag,
    optional,
    preset_file,
    scene_file,
)

if TYPE_CHECKING:
    from rich.console import Console

    from sim.flight.side_by_side import Flight
    from sim.report.rundir import RunFolder


#: Values of --image-size as (width, height) [px].
_SIZES = {"640x480": (640, 480), "424x240": (424, 240)}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Paint:
    """Fly a paint job from the on-board camera under the QP law and the analytic law, and write a report.

    Example: ibvs-qp paint --seed 3 --image-size 424x240 --out runs/seed3
    """

    scene: Annotated[Path | None, optional("FILE")] = None
    """Scene file (TOML), or a shipped scene as dark_board; default: a C of two rows."""
    world: SceneWorld = None
    preset: Annotated[Path | None, optional("FILE")] = None
    """Preset file (TOML), or a shipped one as octorotor_qp: vehicle, gains, weights, limits; default: the law's."""
    vehicle: Annotated[Path | None, optional("FILE")] = None
    """Vehicle that flies instead of the preset's: TOML with [vehicle], PX4 parameters, MJCF or URDF."""
    features: Literal["rendered", "geometric"] = "rendered"
    """Perception: rendered pictures through the vision pipeline, or a sensor model of lines."""
    vision: Literal["own", "paper"] = "own"
    """Vision pipeline: ours, or the paper's as a baseline (topmost horizontal line, first vertical line)."""
    image_size: Annotated[Literal["640x480", "424x240"] | None, optional("640x480|424x240")] = None
    """Picture size; default: the scene's."""
    camera: Literal["plane", "gl", "auto"] = "plane"
    """Camera back end: plane needs no GL library; gl and auto draw with OpenGL if it works, else with plane."""
    strategy: Annotated[str | None, optional("MODULE:CLASS")] = None
    """Strategy of your own, a subclass of ibvs_qp.Strategy: module:Class or file.py:Class; default: paint the scene."""
    controller: Annotated[str | None, optional("MODULE:CLASS")] = None
    """Control law of your own, a subclass of ibvs_qp.PaperController or HybridController, on the preset of --law."""
    rows: Annotated[tuple[str, ...], optional("MODULE:CLASS ...")] = ()
    """Tasks and limits of your own that join the QP law, subclasses of ibvs_qp.tasks.Task and ibvs_qp.limits.Limit."""
    law: Literal["qp", "paper", "both"] = "both"
    """Law to fly; with --controller or --rows both is qp."""
    seed: int = 0
    """Varies start pose, textures, clutter, noise and biases; the same seed repeats the flight."""
    out: Annotated[Path | None, optional("DIR")] = None
    """Run folder; default: runs/<UTC stamp>."""
    overwrite: Annotated[bool, flag] = False
    """Replace the run in --out, file by file, when the new one has been flown."""
    json: Annotated[bool, flag] = False
    """Print summary.json as one line on standard output, and nothing else."""
    view: Annotated[bool, flag] = False
    """Show the flight in MuJoCo's window in real time, one law after the other; without a display the video does."""
    log: Literal["npz", "mcap"] = "npz"
    """Log of the flight: log.npz is always written; mcap adds flight_LAW.mcap for Foxglove, Rerun and replay."""
    no_video: Annotated[bool, flag] = False
    """Do not write the video: the vehicle from outside, camera pictures, push."""

    def run(self, words: list[str]) -> int:
        """Fly, write the run folder, print the figures; an option is rejected before any flight."""
        return dataclasses.replace(self, **self._shown())._run(words)

    def _shown(self) -> dict[str, bool]:
        """`view` and `no_video` as far as this computer can; a note names the missing parts."""
        from sim.flight.viewer import NoDisplay, check_display
        from sim.video.film import missing_encoder

        view, no_video = self.view, self.no_video
        if not no_video and (missing := missing_encoder()):
            print(f"ibvs-qp: {missing}", file=sys.stderr)
            no_video = True
        try:
            if view:
                check_display()
        except NoDisplay as reason:
            if no_video:
                raise
            print(f"ibvs-qp: {reason}; video.mp4 in the run folder will show the flight from outside", file=sys.stderr)
            view = False
        return {"view": view, "no_video": no_video}

    def _run(self, words: list[str]) -> int:
        from rich.console import Console

        from sim.sensors.cameras import resolve_camera

        check_mujoco()
        from sim.flight.jobs import OwnJob
        from sim.flight.options import FlightOptions, pilot_config, sized
        from sim.flight.own_law import check_own
        from sim.flight.preflight import check_job
        from sim.flight.side_by_side import fly_laws
        from sim.flight.working import flight_progress
        from sim.report.rundir import RunFolder
        from sim.vehicles.configuration import require_vehicle, with_camera
        from sim.vehicles.vehicle_file import read_vehicle
        from sim.world.worlds import scene_in_world

        started = time.perf_counter()
        check_seed(self.seed)
        if self.log == "mcap":
            importlib.import_module("ibvs_qp.interfaces.log")  # refused without the extra
        chosen, preset = scene_file(self.scene), preset_file(self.preset)
        scene, world = scene_in_world(chosen, self.world)
        vehicle = preset_file(self.vehicle, "--vehicle", other_formats=True)
        if vehicle is not None:
            given = read_vehicle(vehicle)
            scene = with_camera(scene, given.vehicle)
            for assumption in given.assumptions:
                print(f"ibvs-qp: {assumption}", file=sys.stderr)
        size = _SIZES[self.image_size] if self.image_size else None
        camera, note = resolve_camera(self.camera)
        if note is not None:
            print(f"ibvs-qp: {note}", file=sys.stderr)
        options = FlightOptions(
            seed=self.seed,
            features=self.features,
            vision=self.vision,
            camera=camera,
            image_size=size,
            preset=str(preset) if preset else None,
            vehicle=str(vehicle) if vehicle else None,
            video=not self.no_video,
            compiled=True,
            view=self.view,
            controller=self.controller or "",
            rows=self.rows,
        )
        if vehicle is not None:
            for warning in require_vehicle(pilot_config(scene, options), f"--vehicle {self.vehicle}"):
                print(f"ibvs-qp: {warning}", file=sys.stderr)
        own = bool(self.controller or self.rows)
        laws = ("qp", "paper")[: 2 - own] if self.law == "both" else (self.law,)
        job = OwnJob(name=self.strategy) if self.strategy is not None else None
        for law in laws:  # an unusable preset, job or strategy is refused before anything is shown or written
            flown = dataclasses.replace(options, law=law)
            config = pilot_config(scene, flown)
            check_job(sized(scene, flown), config, self.features, job)
            check_own(flown, config, job)
        notes = Console(stderr=True, quiet=self.json)
        facts = {
            "command": command_line(words),
            "seed": self.seed,
            "scene": str(self.scene) if self.scene else "default",
            "world": world,
            "preset": str(self.preset) if self.preset else None,
            "camera": camera,
            "image_size": list(size or (scene.camera.width, scene.camera.height)),
            "features": self.features,
            "vision": self.vision,
        } | {name: getattr(self, name) for name in ("strategy", "controller", "rows") if getattr(self, name)}
        with RunFolder.open(self.out, overwrite=self.overwrite) as folder:
            options = dataclasses.replace(options, journal=str(folder.journal), mcap=self.log == "mcap")
            with flight_progress(notes, scene, laws) as progress:
                flights = fly_laws(scene, options, laws, progress, workers=1 if self.view else None, task=job)
            return self._report(folder, flights, facts, started, notes)

    def _report(
        self, folder: RunFolder, flights: dict[str, Flight], facts: dict, started: float, notes: Console
    ) -> int:
        from rich.console import Console

        from sim.evaluate.metrics import compute_metrics, false_claims, figure_table
        from sim.evaluate.table import plain
        from sim.flight.trace import INTERRUPTED
        from sim.flight.working import working
        from sim.report.report import own_classes
        from sim.report.rundir import as_json, peak_memory, summary

        traces = {law: flight.trace for law, flight in flights.items()}
        with working(notes, "Computing the figures of merit ..."):
            metrics = {law: compute_metrics(trace) for law, trace in traces.items()}
        interrupted = any(trace.reason == INTERRUPTED for trace in traces.values()) or not traces

        def current() -> dict:
            elapsed = time.perf_counter() - started
            return summary(facts, folder, metrics, interrupted, elapsed, peak_memory(flights.values()))

        with working(notes, "Writing the log ..."):
            folder.write_record(traces, current())
        try:
            with working(notes, "Drawing the report ..."):
                folder.write_report(traces, current(), video=not self.no_video)
        except KeyboardInterrupt:
            interrupted = True
        folder.remove_stale()
        final = current()
        folder.write_summary(final)
        if self.json:
            print(as_json(final))
        else:
            table = figure_table(metrics)
            title = f"Scene {facts['scene']}, world {facts['world']}, seed {facts['seed']}{own_classes(facts)}"
            table.title = plain(title)
            Console().print(table)
            if folder.report.exists():
                print(f"Report: {folder.report}")
            for file in folder.logs():
                from ibvs_qp.interfaces.log import FOXGLOVE_LAYOUT

                print(f"Log: {file}; layout for Foxglove: {FOXGLOVE_LAYOUT}")
        if (false := false_claims(metrics)) and not interrupted:
            print(f"ibvs-qp: warning: {'; '.join(false)}", file=sys.stderr)
        if interrupted:
            print(f"ibvs-qp: interrupted; the partial run is in {folder.path}", file=sys.stderr)
        return EXIT_INTERRUPTED if interrupted else 0
