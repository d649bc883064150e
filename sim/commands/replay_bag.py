"""A ROS 2 bag through the pilot, open loop: phases, refusals, messages left out, and a log of the flight."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ibvs_qp.interfaces.ros.topics import Topics
    from ibvs_qp.pilot import PilotConfig

#: Log in the run folder of a bag.
BAG_LOG = "bag.mcap"
#: Reasons of refused inputs that are printed; the JSON line has all.
MOST_REASONS = 12


@dataclasses.dataclass(kw_only=True)
class BagFlight:
    """Flight of a pilot over a bag.

    Attributes:
        frames, pictures: Given to the pilot.
        duration_s: From the first to the last frame [s].
        phases: Beginning [s], name and reason of every phase and other event of the strategy.
        safety: Frames in every state of the supervisor, and the last reasons of those that are not nominal.
        outcomes: Commands by outcome.
        rejected: Inputs that the pilot refused, by reason without its numbers.
        rejected_last: The last reason of each with its numbers.
        end: Phase at the end, and the condition that it waits for.
        left_out: Messages of the bag that made no frame, by role and reason.
        poses: Of camera and force sensor from the base frame by ``/tf_static``, front-right-down [m].
        differences: Of the bag from its own statements, and of its poses from the vehicle.
    """

    frames: int = 0
    pictures: int = 0
    duration_s: float = 0.0
    phases: list[tuple[float, str, str]] = dataclasses.field(default_factory=list)
    safety: dict[str, int] = dataclasses.field(default_factory=dict)
    safety_reasons: dict[str, str] = dataclasses.field(default_factory=dict)
    outcomes: dict[str, int] = dataclasses.field(default_factory=dict)
    rejected: dict[str, int] = dataclasses.field(default_factory=dict)
    rejected_last: dict[str, str] = dataclasses.field(default_factory=dict)
    end: str = ""
    left_out: dict[str, int] = dataclasses.field(default_factory=dict)
    poses: dict[str, list[float]] = dataclasses.field(default_factory=dict)
    differences: list[str] = dataclasses.field(default_factory=list)


def read_topics(file: Path | None) -> Topics:
    """Topics of a TOML file, or of the section ``[topics]`` of a bridge's settings; the defaults for None."""
    from ibvs_qp.config.errors import ConfigError
    from ibvs_qp.config.files import read_toml
    from ibvs_qp.config.settings import from_dict
    from ibvs_qp.interfaces.ros.topics import Topics

    if file is None:
        return Topics()
    table = read_toml(file)
    try:
        return from_dict(Topics, table.get("topics", table))
    except ConfigError as error:
        raise ConfigError(f"--topics {file}: {error}") from None


def fly_bag(path: Path, topics: Topics, config: PilotConfig, log: Path) -> BagFlight:
    """Step a pilot with every frame of a bag, and record it.

    Raises:
        ConfigError: When the bag is refused or makes no frame; there is no log then.
    """
    from ibvs_qp.config.errors import ConfigError

    try:
        return _fly_bag(path, topics, config, log)
    except ConfigError:
        log.unlink(missing_ok=True)
        raise


def _fly_bag(path: Path, topics: Topics, config: PilotConfig, log: Path) -> BagFlight:
    import warnings

    import numpy as np

    from ibvs_qp.config.errors import ConfigError
    from ibvs_qp.interfaces.log import Recorder
    from ibvs_qp.interfaces.ros.bag import Bag
    from ibvs_qp.interfaces.ros.static_poses import differences
    from ibvs_qp.pilot import Pilot

    bag, pilot, found = Bag(path, topics), Pilot(config), BagFlight()
    outcomes, safety, rejected, first_ns = Counter[str](), Counter[str](), Counter[str](), None
    with contextlib.ExitStack() as stack:
        stack.enter_context(warnings.catch_warnings())
        warnings.simplefilter("ignore")  # the differences are printed
        frames = bag.sensor_frames(config.controller.tick_s, config.camera.distortion)
        stack.callback(frames.close)
        if (first := next(frames, None)) is None:
            most = [f"{count} times {reason}" for reason, count in bag.held.ignored.most_common(MOST_REASONS)]
            raise ConfigError(f"{path}: no frame can be made; left out: {'; '.join(most) or 'no message of the IMU'}")
        recorder = stack.enter_context(Recorder(log, pilot))
        for frame in itertools.chain((first,), frames):
            if frame.image is not None and not found.pictures:
                pilot.prepare(frame.image)
            command = recorder.step(frame)
            first_ns = frame.stamp_ns if first_ns is None else first_ns
            found.frames, found.pictures = found.frames + 1, found.pictures + (frame.image is not None)
            found.duration_s = 1e-9 * (frame.stamp_ns - first_ns)
            outcomes[str(command.outcome)] += 1
            safety[str(command.safety)] += 1
            if command.safety_reasons:
                found.safety_reasons[str(command.safety)] = "; ".join(command.safety_reasons)
            reasons = {text.split(":")[0]: text for text in command.rejected}
            rejected.update(reasons.keys())
            found.rejected_last |= reasons
    found.phases = [(event.time_s, event.name, event.reason) for event in pilot.status.events]
    found.end = pilot.painter.phase + (f", waits for {condition}" if (condition := pilot.waits_for) else "")
    found.outcomes, found.safety, found.rejected = dict(outcomes), dict(safety), dict(rejected)
    found.left_out, found.differences = dict(bag.held.ignored), list(bag.differences)
    names = (bag.frame_ids.get(role, "") for role in ("color", "wrench"))
    camera, force = (bag.poses.pose(name, topics.base_frame) for name in names)
    found.poses = {
        f"{name}_position_m": np.round(pose.position_m, 4).tolist()
        for name, pose in (("camera", camera), ("force_torque", force))
        if pose is not None
    }
    found.differences += differences(camera, force, config.controller.vehicle)
    return found


def bag_text(found: BagFlight) -> list[str]:
    """Lines for the terminal."""
    lines = [f"{found.frames} frames in {found.duration_s:.2f} s, {found.pictures} with a picture"]
    lines += [f"  {time_s:8.2f} s  {name}: {reason}" for time_s, name, reason in found.phases]
    lines.append(f"at the end: {found.end}")
    lines.append("supervisor: " + ", ".join(f"{state} {count}" for state, count in found.safety.items()))
    lines += [f"  {state}: {reason}" for state, reason in found.safety_reasons.items()]
    lines.append("commands: " + ", ".join(f"{outcome} {count}" for outcome, count in found.outcomes.items()))
    refused = {found.rejected_last[head]: count for head, count in found.rejected.items()}
    for title, counts in (("refused by the pilot", refused), ("left out of the bag", found.left_out)):
        reasons = sorted(counts.items(), key=lambda each: -each[1])
        lines.append(f"{title}: {'nothing' if not reasons else ''}".rstrip())
        lines += [f"  {count} times  {reason}" for reason, count in reasons[:MOST_REASONS]]
    lines += [f"tf_static: {name} = {position} from the base frame" for name, position in found.poses.items()]
    if not found.poses:
        lines.append("tf_static: places neither the camera nor the force sensor")
    return lines + [f"the bag: {each}" for each in found.differences]


def summary(path: Path, log: Path, found: BagFlight) -> dict[str, Any]:
    """The JSON line."""
    return {"schema": 1, "bag": str(path), "log": str(log), **dataclasses.asdict(found)}
