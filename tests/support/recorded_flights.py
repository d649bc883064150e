"""Logs of recorded inputs, for the tests of recording and replay."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from recorded_inputs import recording

from ibvs_qp.interfaces.log import Recorder
from ibvs_qp.supervision.assured import Assured
from tests.replay.broken import broken
from tests.replay.cases import CASES


def flown(case: str, kind: str) -> tuple[Any, Iterator[tuple[Any, ...]]]:
    """A new pilot, controller or supervised controller, and its inputs tick by tick."""
    inputs, made = recording(case), CASES[case]
    if made.inputs_of is not None:
        inputs = broken(inputs)
    if kind != "pilot":
        controller: Any = made.controller()
        return Assured(controller) if kind == "assured" else controller, zip(
            inputs.measurements, inputs.references, strict=True
        )
    pilot = made.pilot()

    def frames() -> Iterator[tuple[Any, ...]]:
        for frame, limits in zip(inputs.frames, inputs.thrust_limits, strict=True):
            pilot.thrust_limits = limits
            yield (frame,)

    return pilot, frames()


def record(file: Path, case: str, kind: str, ticks: int | None = None) -> Recorder:
    """Fly recorded inputs and record them; waits for the writer."""
    subject, inputs = flown(case, kind)
    with Recorder(file, subject) as recorder:
        for tick, given in enumerate(inputs):
            if tick == ticks:
                break
            recorder.step(*given)
            recorder.writer.wait_for_room()
    return recorder


def logged(file: Path) -> list[tuple[str, Any]]:
    """Topic and content of every message, by MCAP's own reader."""
    with open(file, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return [(channel.topic, content) for _, channel, _, content in reader.iter_decoded_messages()]
