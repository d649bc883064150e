"""Recorder: one line around a control loop, and its flight is a file that people open and that replays to the bit."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from ibvs_qp.checked_law import CheckedLaw
from ibvs_qp.command import Command
from ibvs_qp.pilot import LawCall, Pilot
from ibvs_qp.recording.header import header
from ibvs_qp.recording.snapshot import copied
from ibvs_qp.recording.ticks import RESET, STEP, SUPERVISOR, ControllerInput
from ibvs_qp.recording.topics import TickTopics
from ibvs_qp.recording.writer import PICTURE_ROOM, LogWriter
from ibvs_qp.supervision.assured import Assured


class Recorder:
    """Records every step of a pilot or controller in an MCAP file (docs/logs.md).

    ``recorder = Recorder("flight.mcap", pilot)``, then ``recorder.step(frame)`` where ``pilot.step(frame)`` was, and
    ``recorder.close()`` at the end; the end of the process closes it, too. Nothing is encoded or written in `step`.

    Attributes:
        writer: The queue and the thread that writes.

    Args:
        file: The file; it is replaced.
        flown: A `Pilot`, an `Assured` controller, a `HybridController` or a `PaperController`.
        pictures: Whether pictures are recorded.

    Raises:
        ConfigError: When the extra ``log`` is not installed.
        IbvsQpError: When the file cannot be written.
    """

    def __init__(self, file: str | Path, flown: Pilot | Assured | CheckedLaw, *, pictures: bool = True) -> None:
        self._flown = flown
        self._pilot = flown if isinstance(flown, Pilot) else None
        self._law: Any = flown if isinstance(flown, CheckedLaw) else flown.controller
        self._setpoints, self._pictures, self._tick = self._law.setpoints, pictures, 0
        self._names = ("measurement", "reference", "contact") if self._pilot is None else ("frame",)
        inputs = self._setpoints.step.inputs
        self._limits = inputs["thrust_low"], inputs["thrust_high"]
        self._call: LawCall | None = None
        self._topics = TickTopics(self._law.config.vehicle)
        self.writer = LogWriter(file, header(flown), lambda: {"ticks": str(self._tick)})
        if self._pilot is not None:
            self._pilot.observer = self._observe

    def __enter__(self) -> Recorder:
        """The recorder itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file."""
        self.close()

    @property
    def dropped(self) -> int:
        """Entries that are missing because the writer was late."""
        return self.writer.dropped

    @property
    def problem(self) -> str:
        """Why nothing more is written, such as a full disk; empty while all is well."""
        return self.writer.problem

    def step(self, *inputs: Any, **named: Any) -> Command:
        """``flown.step(...)``, recorded; never raises.

        Args:
            inputs: Those of the step: a sensor frame, or measurement, reference and maybe contact.
            named: The same by name.

        Returns:
            The command.
        """
        self._call = None
        begin = time.perf_counter_ns()
        command = self._flown.step(*inputs, **named)
        step_ns = time.perf_counter_ns() - begin
        try:
            self._record(dict(zip(self._names, inputs, strict=False)) | named, command, step_ns)
        except Exception:  # of inputs of any type: the flight goes on, and the gap in the ticks shows it
            self.writer.dropped += 1
        self._tick += 1
        return command

    def reset(self) -> None:
        """``flown.reset()``, recorded."""
        self._flown.reset()
        self.writer.offer(self._topics.write_input, ControllerInput(tick=self._tick, call=RESET))
        self._tick += 1

    def note(self, name: str, text: str) -> None:
        """Write a line to the log's topic of events."""
        self.writer.offer(self._topics.write_note, name, text)

    def close(self) -> None:
        """Write the rest and the index."""
        if self._pilot is not None:
            self._pilot.observer = None
        self.writer.close()

    def _observe(self, call: LawCall) -> None:
        self._call = call

    def _record(self, inputs: dict[str, Any], command: Command, step_ns: int) -> None:
        setpoints, (low, high) = self._setpoints, self._limits
        numbers = (self._tick, step_ns, self.writer.dropped, setpoints.push_reference)
        state = (setpoints.contact, low.copy(), high.copy())
        if self._pilot is None:
            given = copied(inputs["measurement"]), copied(inputs["reference"]), inputs.get("contact"), None
            self.writer.offer(self._topics.write_tick, numbers, state, STEP, given, copied(command), command)
            return
        call, pilot = self._call, self._pilot
        assert call is not None  # every step of a pilot calls its law or replaces it
        kind = STEP if call.fixed is None else SUPERVISOR
        given, own = (call.measurement, call.reference, call.contact, call.fixed), copied(call.command)
        seen = (pilot.contact.state, *pilot.motion.state[4:6])
        self.writer.offer(self._topics.write_tick, numbers, state, kind, given, own, command, pilot.painter.phase, seen)
        frame = inputs["frame"]
        image = frame.image
        self.writer.offer(self._topics.write_frame, copied(frame) if image is None else _without_picture(frame))
        if image is not None and self._pictures and pilot.picture is not None:
            perceived = pilot.perception_result
            picture = copied(pilot.picture)
            self.writer.offer(self._topics.write_picture, picture, perceived, command.stamp_ns, room=PICTURE_ROOM)


def _without_picture(frame: Any) -> Any:
    twin = object.__new__(type(frame))
    twin.__dict__.update(frame.__dict__ | {"image": None})
    return copied(twin)
