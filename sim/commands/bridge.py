"""``ibvs-qp bridge``: fly a vehicle on PX4 over DDS; experimental."""

from __future__ import annotations

import contextlib
import dataclasses
import gc
import os
import threading
from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ibvs_qp.config.errors import out_of_range
from sim.commands.options import flag, optional, preset_file

if TYPE_CHECKING:
    from ibvs_qp.interfaces.px4.bridge import Bridge
    from ibvs_qp.interfaces.px4.config import BridgeConfig
    from ibvs_qp.pilot import PilotConfig
    from ibvs_qp.pilot.runner import Timing


#: Shortest time between two lines [s]: a reason may change on every tick, a person reads a few a second.
GAP_S = 0.2
#: Longest wait for the last lines [s].
LAST_S = 1.0
#: File descriptor of standard output (POSIX).
STANDARD_OUTPUT = 1


class StatusLines:
    """Writes the newest line. While the output is blocked, lines are dropped; a closed output changes nothing.

    It writes to the descriptor: a thread that is blocked in `sys.stdout` would also block the end of the process.

    Args:
        descriptor: File descriptor of the output.
    """

    def __init__(self, descriptor: int = STANDARD_OUTPUT) -> None:
        self._descriptor, self._newest = descriptor, deque[str](maxlen=1)
        self._some, self._closing = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._write, name="status lines", daemon=True)
        self._thread.start()

    def put(self, text: str) -> None:
        """Replace the line to write next; never blocks, and never raises."""
        self._newest.append(text)
        self._some.set()

    def close(self, text: str) -> None:
        """Write the last lines, and wait for them at most `LAST_S`."""
        self._newest.append(text)
        self._closing.set()
        self._some.set()
        self._thread.join(LAST_S)

    def _write(self) -> None:
        last = False
        while not last:
            self._some.wait()
            self._some.clear()
            last = self._closing.is_set()  # before the text is taken: that of `close` is then among those taken
            while self._newest:
                with contextlib.suppress(OSError):
                    os.write(self._descriptor, f"{self._newest.pop()}\n".encode(errors="replace"))
            self._closing.wait(GAP_S)


#: Longest run [s], a day, and time between two lines about a state that lasts [s].
_LONGEST_S, _REPORT_S = 86400.0, 5.0


@dataclasses.dataclass(frozen=True, kw_only=True)
class BridgeCommand:
    """Fly a vehicle on PX4 over DDS, without ROS; experimental, never flown on hardware (docs/px4.md).

    Example: ibvs-qp bridge --preset tarot_t960_qp --dry-run
    """

    preset: Annotated[Path, optional("FILE")] = Path("tarot_t960_qp")
    """Preset of the flight, or the name of a shipped one; default: tarot_t960_qp."""
    vehicle: Annotated[Path | None, optional("FILE")] = None
    """Vehicle in place of the preset's: as of ``ibvs-qp vehicle``."""
    config: Annotated[Path | None, optional("FILE")] = None
    """Topics, output, time-outs and thrust curve of the bridge (TOML); default: PX4's topics and a RealSense."""
    duration: Annotated[float | None, optional("S")] = None
    """End after this time; default: at Ctrl-C."""
    dry_run: Annotated[bool, flag] = False
    """Print topics, types and checks, and connect to nothing."""
    json: Annotated[bool, flag] = False
    """Print one JSON line on standard output at the end, and nothing else."""

    def run(self, words: list[str]) -> int:
        """Run the bridge, or print its plan."""
        from ibvs_qp.interfaces.px4.config import BridgeConfig
        from sim.commands.bridge import StatusLines
        from sim.flight.stop import handled_ctrl_c
        from sim.report.rundir import as_json

        if self.duration is not None and not 0.0 < self.duration <= _LONGEST_S:
            raise out_of_range("--duration", self.duration, "s", f"it lies above 0 and is at most {_LONGEST_S:g} s")
        config = BridgeConfig() if self.config is None else BridgeConfig.from_toml(self.config)
        flight = self._flight()
        if self.dry_run:
            plan = _plan(config, flight)
            print(as_json(plan)) if self.json else _show(plan)
            return 0
        from ibvs_qp.interfaces.px4.bridge import Bridge

        bridge, timing, lines = Bridge(config, flight), None, None if self.json else StatusLines()
        interrupts = list[bool]()
        try:
            with handled_ctrl_c(lambda *_: interrupts.append(True)):  # the tick ends first
                timing = _fly(bridge, self.duration, lines, interrupts)
        finally:
            if lines is not None:
                lines.close(_summary(bridge, timing))
            else:
                taken = None if timing is None else dataclasses.asdict(timing)
                print(as_json({"schema": 1, **dataclasses.asdict(bridge.status), "timing": taken}))
        if interrupts:
            raise KeyboardInterrupt
        return 0

    def _flight(self) -> PilotConfig:
        from ibvs_qp.pilot import PilotConfig
        from sim.commands.vehicle import read_vehicle

        file = preset_file(self.preset)
        assert file is not None
        flight = PilotConfig.from_toml(file)
        if self.vehicle is None:
            return flight
        controller = dataclasses.replace(flight.controller, vehicle=read_vehicle(self.vehicle).vehicle)
        return dataclasses.replace(flight, controller=controller)


def _fly(bridge: Bridge, duration_s: float | None, lines: StatusLines | None, interrupts: list[bool]) -> Timing:
    """Run the loop until its duration or an interrupt ends it."""
    from ibvs_qp.pilot.runner import run

    reported_ns, end_ns, last = 0, None, ""

    def tick(now_ns: int) -> bool:
        nonlocal reported_ns, end_ns, last
        bridge.tick(now_ns)
        if end_ns is None:
            end_ns = -1 if duration_s is None else now_ns + round(1e9 * duration_s)
        state = f"{bridge.gate.state}: {bridge.gate.reason}"
        if lines is not None and (state != last or now_ns - reported_ns > round(1e9 * _REPORT_S)):
            reported_ns, last = now_ns, state
            lines.put(_line(bridge))
        return not (interrupts or 0 < end_ns <= now_ns)

    gc.collect()
    gc.freeze()  # loaded modules stay: the collector would visit them during the flight, for 20 ms each time
    return run(tick, 1.0 / bridge.tick_s)


def _line(bridge: Bridge) -> str:
    status = bridge.status
    flight = f"; phase {status.phase}, {status.safety}" if status.phase else ""
    ignored = ""
    if counts := status.ignored:
        ignored = f"; ignored {sum(counts.values())} messages, most: {max(counts, key=lambda reason: counts[reason])}"
    return f"{status.state}: {status.reason}{flight}; {status.commands} commands{ignored}"


def _summary(bridge: Bridge, timing: Timing | None) -> str:
    """Last lines: status, every reason of an ignored message, and timing."""
    lines = [_line(bridge)]
    lines += [f"ignored {count} times: {reason}" for reason, count in sorted(bridge.status.ignored.items())]
    if timing is not None:
        lines.append(
            f"{timing.ticks} ticks, {timing.overruns} overruns; duration of a tick: median {timing.p50_us:.0f} us, "
            f"99 % {timing.p99_us:.0f} us, largest {timing.max_us:.0f} us"
        )
    return "\n".join(lines)


def _plan(config: BridgeConfig, flight: PilotConfig) -> dict[str, Any]:
    """Inputs, outputs and conditions of the bridge; refuses settings that do not fit the vehicle."""
    from ibvs_qp.interfaces.px4.bridge import checks
    from ibvs_qp.interfaces.px4.dds import dds_topic, dds_type
    from ibvs_qp.interfaces.px4.inputs import subscriptions
    from ibvs_qp.interfaces.px4.outputs import Outputs, publications

    curve = Outputs(config, flight.controller.vehicle).curve
    reads = {each.topic: each.type_name for each in subscriptions(config)}

    def named(topics: dict[str, str]) -> list[dict[str, str]]:
        return [
            {"topic": topic, "type": name, "dds_topic": dds_topic(topic), "dds_type": dds_type(name)}
            for topic, name in topics.items()
        ]

    return {
        "schema": 1,
        "domain_id": config.domain_id,
        "rate_hz": 1.0 / flight.controller.tick_s,
        "subscribes": named(reads),
        "publishes": named(publications(config)),
        "curve": {"thrust_max_n": curve.thrust_max_n, "quadratic": curve.quadratic},
        "checks": list(checks(config, flight)),
    }


def _show(plan: dict[str, Any]) -> None:
    width = max(len(each["topic"]) for title in ("subscribes", "publishes") for each in plan[title])
    for title in ("subscribes", "publishes"):
        for each in plan[title]:
            print(f"{title:10}  {each['topic']:{width}}  {each['type']}")
    example = plan["publishes"][0]
    print(f"in DDS      domain {plan['domain_id']}; {example['dds_topic']} of {example['dds_type']}, and so on")
    print(f"            best effort, volatile, keep last; {plan['rate_hz']:g} Hz")
    curve = plan["curve"]
    print(f"rotors      {curve['thrust_max_n']:g} N at full command, quadratic share {curve['quadratic']:g}")
    print("PX4 enters Offboard mode only with the bridge's proof of life, which begins when:")
    for check in plan["checks"]:
        print(f"  - {check}")
