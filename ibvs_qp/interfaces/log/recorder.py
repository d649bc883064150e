"""Recorder: its `step` in place of a controller's records the flight in a file that viewers open and that replays."""

from __future__ import annotations

import re
import time
import typing
from pathlib import Path
from typing import Any

import numpy as np

from ibvs_qp.checked_law import CheckedLaw
from ibvs_qp.command import Command
from ibvs_qp.interfaces.log import topics
from ibvs_qp.interfaces.log.camera import CameraTopics
from ibvs_qp.interfaces.log.header import header
from ibvs_qp.interfaces.log.writer import PICTURE_ROOM, Log, LogWriter
from ibvs_qp.measurement import FeatureFrame, LineFeature, Measurement, Reference, RgbdFrame, SensorFrame
from ibvs_qp.pilot import LawCall, Pilot
from ibvs_qp.supervision.assured import Assured

_COPIED = (Command, FeatureFrame, LineFeature, Measurement, Reference, RgbdFrame, SensorFrame)
_MUTABLE = re.compile(r"ndarray|tuple\[float|LineFeature|FeatureFrame|RgbdFrame")
#: Fields of the types that `copied` copies which contain arrays or such types.
_ARRAYS = {
    kind: [name for name, hint in typing.get_type_hints(kind).items() if _MUTABLE.search(str(hint))] for kind in _COPIED
}


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
        self._flown, self._pilot = flown, flown if isinstance(flown, Pilot) else None
        law: Any = flown if isinstance(flown, CheckedLaw) else flown.controller
        self._setpoints, self._pictures, self._tick = law.setpoints, pictures, 0
        self._call: LawCall | None = None
        self._topics, self._camera = topics.TickTopics(law.config.vehicle), CameraTopics()
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
        step_us = (time.perf_counter_ns() - begin) * 1e-3
        try:
            names = ("measurement", "reference", "contact") if self._pilot is None else ("frame",)
            self._record(dict(zip(names, inputs, strict=False)) | named, command, step_us)
        except Exception:  # of inputs of any type: the flight goes on, and the gap in the ticks shows it
            self.writer.dropped += 1
        self._tick += 1
        return command

    def reset(self) -> None:
        """``flown.reset()``, recorded."""
        self._flown.reset()
        given = topics.ControllerInput(tick=self._tick, call=topics.RESET)
        self.writer.offer(topics.write_message, topics.INPUT_TOPIC, given)
        self._tick += 1

    def note(self, name: str, text: str) -> None:
        """Write a line to the log's topic of events."""
        self.writer.offer(LogWriter.note, Log.INFO, name, text)

    def close(self) -> None:
        """Write the rest and the index."""
        if self._pilot is not None:
            self._pilot.observer = None
        self.writer.close()

    def _observe(self, call: LawCall) -> None:
        self._call = call

    def _record(self, inputs: dict[str, Any], command: Command, step_us: float) -> None:
        pilot, setpoints, limits = self._pilot, self._setpoints, self._setpoints.step.inputs
        if pilot is None:
            inputs = {name: copied(each) for name, each in inputs.items()}
            call = LawCall(inputs["measurement"], inputs["reference"], inputs.get("contact"), None, command)
            phase, contact, odometer = "", setpoints.contact, (0.0, 0.0)
        else:
            assert self._call is not None  # every step of a pilot calls its law or replaces it
            call, phase, contact = self._call, pilot.painter.phase, pilot.contact.state
            odometer = pilot.motion.state[4:6]
        given = topics.ControllerInput(
            tick=self._tick,
            call=topics.STEP if call.fixed is None else topics.SUPERVISOR,
            measurement=call.measurement,
            reference=call.reference,
            contact=call.contact,
            fixed_thrusts=call.fixed,
        )
        row = topics.ControlTick(
            tick=self._tick,
            stamp_ns=call.command.stamp_ns,
            phase=phase,
            safety=command.safety,
            safety_reasons=command.safety_reasons,
            rejected=command.rejected,
            push_n=contact.push,
            push_reference_n=setpoints.push_reference,
            distance_m=contact.distance,
            thrust_low_n=limits["thrust_low"].copy(),
            thrust_high_n=limits["thrust_high"].copy(),
            step_us=step_us,
            dropped=self.writer.dropped,
            command=copied(call.command),
        )
        self.writer.offer(self._topics, given, row, contact, tuple(odometer))
        if pilot is None:
            return
        frame = inputs["frame"]
        self.writer.offer(topics.write_message, topics.SENSORS_TOPIC, copied(frame, image=None), SensorFrame)
        if frame.image is not None and self._pictures and pilot.picture is not None:
            seen = copied(pilot.picture), pilot.perception_result, command.stamp_ns
            self.writer.offer(self._camera, *seen, room=PICTURE_ROOM)


def copied(value: Any, **replaced: Any) -> Any:
    """An input with arrays of its own, because the caller may use them again; other values as they are."""
    kind = type(value)
    if kind in (tuple, list):
        return kind([copied(each) if type(each) in _ARRAYS else each for each in value])
    if kind not in _ARRAYS:
        return value
    fields = value.__dict__ | replaced
    for name in _ARRAYS[kind]:
        entry = fields[name]
        fields[name] = entry.copy() if type(entry) is np.ndarray else copied(entry)
    twin = object.__new__(kind)
    twin.__dict__.update(fields)
    return twin
