"""``ibvs-qp detect``: surface plane, lines and guides in one frame, a folder of frames or a ROS bag."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from ibvs_qp.config.errors import ConfigError
from sim.commands.options import check_seed, flag, optional
from sim.detection.methods import METHODS

if TYPE_CHECKING:
    from ibvs_qp.vision.picture.settings import RgbdCameraSettings
    from sim.detection.manifest import FrameEntry
    from sim.detection.run import FrameResult


#: Largest coefficient of a lens [-]: those of wide lenses stay below 10.
_LARGEST_DISTORTION = 100.0
#: Options that a single frame needs besides --rgb.
_CAMERA = ("fx", "fy", "cx", "cy")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Detect:
    """Find the surface and its edges in one RGB-D frame, in a folder of frames with a manifest.csv, or in a ROS 2 bag.

    Example: ibvs-qp detect --rgb c.png --depth d.png --fx 607 --fy 607 --cx 321 --cy 242 --depth-units-per-metre 1000
    --seed-pixel 270 150 --overlay pictures
    """

    bag: Annotated[Path | None, tyro.conf.Positional, optional("BAG")] = None
    """ROS 2 bag: a folder, or a single .mcap or .db3 file; its pictures are a motion sequence (needs the extra ros)."""
    topics: Annotated[Path | None, optional("FILE")] = None
    """Topics of the bag (TOML: color, depth, camera_info); default: those of RealSense's ROS wrapper."""
    rgb: Annotated[Path | None, optional("FILE")] = None
    """Colour picture of one frame (8 or 16 bits)."""
    depth: Annotated[Path | None, optional("FILE")] = None
    """Depth picture registered to colour (8 or 16 bits or floating point; 0 = invalid); without it: lines only."""
    fx: Annotated[float | None, optional("PX")] = None
    """Focal length along the rows."""
    fy: Annotated[float | None, optional("PX")] = None
    """Focal length along the columns."""
    cx: Annotated[float | None, optional("PX")] = None
    """Column of the principal point, pixel centres at integers."""
    cy: Annotated[float | None, optional("PX")] = None
    """Row of the principal point."""
    depth_units_per_metre: Annotated[float | None, optional("UNITS")] = None
    """Depth values per metre: 1000 for millimetres (default without --camera), 5000 for TUM, 1 for metres."""
    camera: Annotated[Path | None, optional("FILE")] = None
    """TOML file with [camera] as of a preset: lenses, and the place of a separate depth camera."""
    distortion: Annotated[tuple[float, float, float, float, float] | None, optional("K1 K2 P1 P2 K3")] = None
    """Lens distortion in OpenCV's order; pictures are rectified, pixels stay those of the picture as taken. Default:
    that of --camera or of the bag's camera_info, else none."""
    seed_pixel: Annotated[tuple[float, float] | None, optional("U V")] = None
    """A pixel on the surface; without it: lines only, no surface and no guides."""
    sequence: Annotated[Path | None, optional("DIR")] = None
    """Folder of frames; frames named PREFIX_NUMBER_color with consecutive numbers are a motion sequence."""
    method: Literal[tuple(METHODS)] = "own"  # type: ignore[valid-type]
    """Pipeline."""
    all: Annotated[bool, flag] = False
    """List every line of the whole picture as candidate, on the surface or not."""
    track: Annotated[bool, flag] = False
    """Track lines through a motion sequence (default)."""
    no_track: Annotated[bool, flag] = False
    """Process every frame on its own."""
    overlay: Annotated[Path | None, optional("DIR")] = None
    """Write a picture of every frame with the detections drawn in."""
    json: Annotated[bool, flag] = False
    """Print the result as one line of JSON on standard output, and nothing else."""
    seed: int = 0
    """Accepted by every command; without effect here."""

    def run(self, words: list[str]) -> int:
        """Process the frames and print the detections; the exit code is 0 also if a frame has no surface."""
        import cv2
        from rich.console import Console

        from sim.detection.report import as_json, frame_table, refusals
        from sim.flight.working import working

        check_seed(self.seed)
        cv2.setNumThreads(1)
        self._check()
        folder = None if self.overlay is None else _folder(self.overlay)
        notes = Console(stderr=True, quiet=self.json)
        with working(notes, "Detecting ...") as update:
            frames = self._files(update, folder) if self.bag is None else self._pictures(self.bag, update, folder)
        if self.json:
            print(as_json(frames, self.method))
        else:
            Console().print(frame_table(frames))
            for reason in refusals(frames):
                print(reason)
            if folder is not None:
                print(f"Pictures: {folder}")
        return 0

    def _files(self, update: Callable[[str], None], folder: Path | None) -> list[FrameResult]:
        """Results of one frame or a folder."""
        from sim.detection.report import write_overlay
        from sim.detection.run import detect_frames
        from sim.evaluate.table import plain

        frames = detect_frames(
            self._entries(),
            self.method,
            every=self.all,
            track=not self.no_track,
            started=lambda entry: update(f"Detecting in {plain(entry.color)} ..."),
        )
        if folder is not None:
            for seen in frames:
                write_overlay(seen, folder)
        return frames

    def _pictures(self, path: Path, update: Callable[[str], None], folder: Path | None) -> list[FrameResult]:
        """Results of the pictures of a bag."""
        from ibvs_qp.config.settings import load_toml
        from ibvs_qp.interfaces.ros.bag import Bag
        from ibvs_qp.interfaces.ros.topics import Topics
        from sim.detection.report import write_overlay
        from sim.detection.run import detect_bag
        from sim.evaluate.table import plain

        bag = Bag(path, None if self.topics is None else load_toml(Topics, self.topics))

        def finished(seen: FrameResult) -> None:
            update(f"Detected in {plain(seen.entry.color)} ...")
            if folder is not None:
                write_overlay(seen, folder)

        frames = detect_bag(
            bag,
            self.method,
            every=self.all,
            track=not self.no_track,
            seed=self.seed_pixel,
            settings=self._settings(),
            finished=finished,
        )
        if not frames:
            ignored = ", ".join(f"{count} {reason}" for reason, count in bag.held.ignored.items())
            raise ConfigError(f"{path} has no pair of colour and depth pictures" + (f" ({ignored})" if ignored else ""))
        return frames

    def _check(self) -> None:
        """Raise ConfigError for options that contradict each other."""
        if self.distortion is not None and not all(abs(value) <= _LARGEST_DISTORTION for value in self.distortion):
            limit = f"of size {_LARGEST_DISTORTION:g} at most"
            raise ConfigError(f"--distortion must be five finite numbers {limit}: k1 k2 p1 p2 k3")
        if self.track and self.no_track:
            raise ConfigError("--track and --no-track exclude each other")
        if sum(each is not None for each in (self.bag, self.rgb, self.sequence)) != 1:
            raise ConfigError("give either a ROS bag, --rgb FILE with its camera, or --sequence DIR")
        if self.topics is not None and self.bag is None:
            raise ConfigError("--topics is for a ROS bag")

    def _settings(self) -> RgbdCameraSettings | None:
        """The camera of the options, or None if they state nothing of it."""
        from ibvs_qp.config.files import read_toml
        from ibvs_qp.config.settings import from_dict
        from ibvs_qp.pilot.config import CameraConfig
        from ibvs_qp.vision.picture.settings import RgbdCameraSettings

        if self.camera is None:
            return None if self.distortion is None else RgbdCameraSettings(distortion=self.distortion)
        table = read_toml(self.camera)
        if not isinstance(table.get("camera"), dict):
            raise ConfigError(f"{self.camera} has no [camera]")
        try:
            settings = from_dict(CameraConfig, table["camera"], "camera")
        except ConfigError as error:
            raise ConfigError(f"{self.camera}: {error}") from None
        return settings if self.distortion is None else dataclasses.replace(settings, distortion=self.distortion)

    def _entries(self) -> list[FrameEntry]:
        """Frames of the command line, checked."""
        from ibvs_qp.vision.picture.settings import RgbdCameraSettings
        from sim.detection.manifest import LARGEST_PX, FrameEntry, read_manifest
        from sim.detection.pictures import read_frame

        if self.sequence is not None:
            return read_manifest(self.sequence, self._settings())
        assert self.rgb is not None
        missing = [name for name in _CAMERA if getattr(self, name) is None]
        if missing:
            raise ConfigError(f"--{missing[0]} is missing: a single frame needs --fx --fy --cx --cy")
        camera = tuple(float(getattr(self, name)) for name in _CAMERA)
        if not (min(camera[:2]) > 1.0 and all(abs(value) <= LARGEST_PX for value in camera)):
            limit = f"{LARGEST_PX:g} px"
            raise ConfigError(f"--fx and --fy must be above 1 px, and the size of --fx --fy --cx --cy at most {limit}")
        settings, units = self._settings(), self.depth_units_per_metre
        if units is None:
            units = 1000.0 if self.camera is None or settings is None else settings.depth_units_per_metre
        if not (math.isfinite(units) and units > 0.0):
            raise ConfigError(f"--depth-units-per-metre {units:g} is refused: it must be above 0")
        entry = FrameEntry(
            color=str(self.rgb),
            depth="" if self.depth is None else str(self.depth),
            folder=Path(),
            intrinsics=(camera[0], camera[1], camera[2], camera[3]),
            depth_units_per_metre=units,
            seed=self.seed_pixel,
            camera=settings or RgbdCameraSettings(),
        )
        read_frame(
            self.rgb, self.depth, entry.intrinsics, entry.depth_units_per_metre, camera=entry.camera
        )  # raises on unusable files before any work
        return [entry]


def _folder(path: Path) -> Path:
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise ConfigError(f"cannot write pictures to {path}: {reason}; give another --overlay") from None
    return path
