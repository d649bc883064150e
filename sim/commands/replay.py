"""``ibvs-qp replay``: a recorded controller on its recorded inputs, another preset on them, or a pilot on a bag."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from ibvs_qp.config.errors import ConfigError
from sim.commands.options import flag, optional, preset_file

if TYPE_CHECKING:
    from ibvs_qp.interfaces.log import PresetComparison, RecordedFlight, Replay

#: Answer for a log without a tick to compare.
NOTHING = "Nothing was compared: the log has no ticks up to its first gap."


@dataclasses.dataclass(frozen=True, kw_only=True)
class ReplayCommand:
    """Run the recorded controller on the inputs of a log, or the pilot on a ROS 2 bag.

    A log gives bit-identical commands, or the first difference; a bag its phases, refusals and counts, and a log.

    Example: ibvs-qp replay runs/one/flight_qp.mcap --preset tarot_t960_paper

    Example: ibvs-qp replay my_bag --topics topics.toml --vehicle my_vehicle.toml
    """

    log: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="LOG_OR_BAG")]
    """MCAP log of paint --log mcap, or of ibvs_qp.interfaces.log.Recorder, also of a killed process; or a ROS 2 bag."""
    preset: Annotated[Path | None, optional("FILE")] = None
    """Preset file (TOML), or a shipped one: of a log, show its commands instead; of a bag, the pilot's."""
    topics: Annotated[Path | None, optional("FILE")] = None
    """Topics of the bag (TOML, docs/bags.md); default: /imu/data, /ft_sensor/wrench and those of a RealSense."""
    vehicle: Annotated[Path | None, optional("FILE")] = None
    """Vehicle of the bag in place of the preset's: as of ``ibvs-qp vehicle``."""
    out: Annotated[Path | None, optional("DIR")] = None
    """Run folder of a bag; default: runs/<UTC stamp>."""
    repair: Annotated[Path | None, optional("FILE")] = None
    """Write the log again with its end and index, for viewers that refuse the log of a killed process."""
    json: Annotated[bool, flag] = False
    """Print one JSON line on standard output, and nothing else."""

    def run(self, words: list[str]) -> int:
        """Replay and print."""
        import ibvs_qp.interfaces.log  # noqa: F401  # names the extra where it is missing: both kinds need it
        from ibvs_qp.interfaces.ros.recording import is_bag

        if self.log.name == "metadata.yaml":  # the part of a bag that a file dialog offers
            return dataclasses.replace(self, log=self.log.parent)._bag()
        return self._bag() if is_bag(self.log) else self._log()

    def _bag(self) -> int:
        from rich.console import Console

        from ibvs_qp.pilot import PilotConfig
        from sim.commands.replay_bag import BAG_LOG, bag_text, fly_bag, read_topics, summary
        from sim.flight.working import working
        from sim.report.rundir import RunFolder, as_json, write_json
        from sim.vehicles.configuration import with_vehicle
        from sim.vehicles.vehicle_file import read_vehicle

        if self.repair is not None:
            raise ConfigError("--repair is for logs of ibvs_qp; a bag that was cut is read up to its end")
        topics, file = read_topics(self.topics), preset_file(self.preset)
        config = PilotConfig() if file is None else PilotConfig.from_toml(file)
        vehicle = preset_file(self.vehicle, "--vehicle", other_formats=True)
        if vehicle is not None:
            config = with_vehicle(config, read_vehicle(vehicle).vehicle)
        with RunFolder.open(self.out) as folder:
            log = folder.path / BAG_LOG
            with working(Console(stderr=True, quiet=self.json), "Flying the bag ..."):
                found = fly_bag(self.log, topics, config, log)
            content = summary(self.log, log, found)
            write_json(folder.path / "bag.json", content)
        print(as_json(content) if self.json else "\n".join([*bag_text(found), f"Log: {log}"]))
        return 0

    def _log(self) -> int:
        from rich.console import Console

        from ibvs_qp.interfaces.log import compare_preset, read_log, repair, replay
        from ibvs_qp.pilot import PilotConfig
        from sim.flight.working import working
        from sim.report.rundir import as_json

        flight = read_log(self.log)
        file = preset_file(self.preset)
        preset = None if file is None else PilotConfig.from_toml(file)
        if self.repair is not None:
            repair(flight, self.repair)
        try:
            with working(Console(stderr=True, quiet=self.json), "Replaying ..."):
                result = replay(flight) if preset is None else compare_preset(flight, preset)
        except ConfigError as error:
            raise ConfigError(f"{self.log}: {error}") from None
        if self.json:
            print(as_json(_summary(flight, result)))
        else:
            print("\n".join(_text(flight, result)))
            if self.repair is not None:
                print(f"Written: {self.repair}")
        return 0


def _summary(flight: RecordedFlight, result: Replay | PresetComparison) -> dict[str, Any]:
    facts = {name: flight.facts[name] for name in ("version", "kind", "law")}
    return {"schema": 1, "log": str(flight.file), **facts, **dataclasses.asdict(result), "same": result.same}


def _text(flight: RecordedFlight, result: Replay | PresetComparison) -> list[str]:
    from ibvs_qp import __version__
    from ibvs_qp.interfaces.log import PresetComparison

    lines = _preset_text(result) if isinstance(result, PresetComparison) else _replay_text(result)
    if flight.facts["version"] != __version__:
        lines.append(f"Recorded by version {flight.facts['version']}; this is {__version__}.")
    if result.missing:
        lines.append(f"The replay ends where {result.missing} ticks are missing in the log.")
    if not result.complete:
        lines.append("The log has no end: its process was killed, or the file is damaged there.")
    return lines


def _replay_text(result: Replay) -> list[str]:
    if result.first is None:
        return [f"Bit-identical over {result.ticks} ticks."] if result.ticks else [NOTHING]
    first = result.first
    lines = [
        f"Differs: {result.differing} of {result.ticks} ticks; first at tick {first.tick}, {_seconds(first.stamp_ns)}:"
        f" {first.field} {_amount(first.amount, first.unit, first.text)}."
    ]
    for name, each in result.largest.items():
        where = "largest" if math.isfinite(each.amount) else "first"
        amount = _amount(each.amount, each.unit, each.text)
        lines.append(f"  {name}: {where} at tick {each.tick}, {_seconds(each.stamp_ns)}: {amount}")
    return lines


def _preset_text(result: PresetComparison) -> list[str]:
    if not result.ticks:
        return [NOTHING]
    if result.same:
        return [f"The commands of the preset are bit-identical over {result.ticks} ticks."]
    lines = [
        f"The preset's commands on the recorded inputs, {result.ticks} ticks:",
        f"  thrusts: difference {result.thrust_rms_n:.3f} N rms, {result.thrust_peak_n:.3f} N peak at tick"
        f" {result.peak_tick}",
    ]
    if result.push_ticks:
        lines.append(
            f"  push task, {result.push_ticks} ticks: commands {result.push_preset_n:.3f} N on average instead of"
            f" {result.push_recorded_n:.3f} N, difference {result.push_rms_n:.3f} N rms"
        )
    for name in sorted({*result.limits_recorded, *result.limits_preset}):
        before, after = (
            limits.get(name, 0) / result.ticks for limits in (result.limits_recorded, result.limits_preset)
        )
        lines.append(f"  limit {name}: active in {after:.1%} of the ticks instead of {before:.1%}")
    lines.append("Inputs are the recorded ones: they lack the reaction of the vehicle to the preset.")
    return lines


def _seconds(stamp_ns: int) -> str:
    return f"{stamp_ns * 1e-9:.3f} s"


def _amount(amount: float, unit: str, text: str) -> str:
    return text or f"by {amount:.3g} {unit}".rstrip()
