"""Static push at and beyond the reach of the rotors: errors of both laws and reports of their commands."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from closed_loop_rigs import wall

from sim.experiments.variants import VARIANTS
from sim.flight.closed_loop import fly
from sim.flight.jobs import PressJob
from sim.flight.options import FlightOptions, pilot_config, unsupervised
from sim.flight.trace import Trace
from sim.world.scene import Scene

#: Push that the nominal vehicle can hold standing still [N].
REACH_N = 30.4


def press(
    push: float,
    friction: float,
    reach_check: bool = True,
    law: str = "qp",
    slide_s: float = 0.0,
    printed: bool = False,
) -> Trace:
    """Press at one place, and optionally slide to the left; ``printed``: line rows of the paper, with their gains."""
    scene = Scene(wall=wall(friction=friction))
    scene = dataclasses.replace(scene, paint=dataclasses.replace(scene.paint, push_n=push))
    options = FlightOptions(law=law, features="geometric", video=False)
    config = unsupervised(pilot_config(scene, options))  # what the laws do by themselves
    if printed:
        config = VARIANTS["printed"].apply(config)
        config = dataclasses.replace(
            config, controller=dataclasses.replace(config.controller, touch_ramp=True, contact_feedforward=True)
        )
    config = dataclasses.replace(config, controller=dataclasses.replace(config.controller, reach_check=reach_check))
    return fly(scene, options, config=config, job=PressJob(hold_s=2.5 if slide_s else 8.0, slide_s=slide_s))


def settled(trace: Trace) -> np.ndarray:
    """The hold after the first three seconds of full weight: ticks."""
    holding = np.flatnonzero((trace.contact_weight > 0.99) & (trace.phase == trace.phases.index("press")))
    return holding[trace.t[holding] > trace.t[holding[0]] + 3.0]


def notes(trace: Trace) -> list[str]:
    """What was said about inputs."""
    return [event.text for event in trace.events if event.kind == "rejected"]


STATIC = [(15.0, 0.3), (15.0, 0.05), (20.0, 0.3), (25.0, 0.3), (25.0, 0.05), (30.0, 0.3), (30.0, 0.05)]


@pytest.mark.slow
@pytest.mark.parametrize(("push", "friction"), [*STATIC, (20.0, 0.05)])
def test_a_static_push_within_reach_is_delivered(push: float, friction: float) -> None:
    trace = press(push, friction, reach_check=True)
    ticks = settled(trace)
    delivered = float(trace.push_true[ticks].mean())
    print(f"{push:g} N at mu {friction:g}: {delivered:.2f} N")
    assert trace.claimed and delivered == pytest.approx(push, rel=0.05)


@pytest.mark.parametrize("reach_check", [True, False])
def test_a_push_beyond_reach_is_given_up_and_nothing_else(reach_check: bool) -> None:
    trace = press(35.0, 0.3, reach_check)
    ticks = settled(trace)
    delivered, tilt = float(trace.push_true[ticks].mean()), np.degrees(trace.euler[ticks, :2])
    height = float(np.ptp(trace.position[ticks, 2]))
    print(f"35 N: {delivered:.2f} N, height {1e3 * height:.1f} mm, tilt {np.abs(tilt).max():.2f} deg peak")
    assert trace.claimed and delivered >= 0.94 * REACH_N
    assert height <= 0.05 and np.sqrt((tilt**2).mean()) <= 1.0 and np.abs(tilt).max() <= 2.0
    assert any("reduced" in text and "reach standing still" in text for text in notes(trace)) is reach_check


@pytest.mark.slow
@pytest.mark.parametrize(("push", "least"), [(29.5, 29.4), (30.0, 29.85), (35.0, 29.6)])
def test_a_push_at_the_reach_costs_no_tilt(push: float, least: float) -> None:
    """Noise of all other rows is clipped; a law that clips everything tilts by 1 deg for 35 N."""
    trace = press(push, 0.3, reach_check=False)
    ticks = settled(trace)
    delivered, turned = float(trace.push_true[ticks].mean()), np.degrees(np.abs(trace.euler[ticks])).max(axis=0)
    print(f"qp {push:g} N: {delivered:.2f} N, roll, pitch, yaw {turned.round(2)} deg at most")
    assert trace.claimed and delivered >= least
    assert turned.max() <= 0.3


@pytest.mark.slow
@pytest.mark.parametrize("push", [25.0, 26.0, 27.0, 28.0])
def test_within_reach_the_laws_push_alike(push: float) -> None:
    """Nothing is clipped in a quiet hold below the reach: there neither law has an advantage."""
    for law in ("qp", "paper"):
        trace = press(push, 0.3, reach_check=False, law=law)
        ticks = settled(trace)
        error = trace.push_true[ticks] - push
        height = float(np.ptp(trace.position[ticks, 2]))
        print(f"{law} {push:g} N: {error.mean():+.3f} N, {error.std():.3f} N, height {1e3 * height:.1f} mm")
        assert trace.claimed and abs(error.mean()) <= 0.01 * push and error.std() <= 0.2
        assert height <= 2e-3 and np.abs(np.degrees(trace.euler[ticks])).max() <= 0.3


@pytest.mark.slow
def test_beyond_reach_clipping_leans_on_the_wall_and_the_program_stays_level() -> None:
    """35 N unchecked."""
    program, clipped = (press(35.0, 0.3, reach_check=False, law=law) for law in ("qp", "paper"))
    tilt = [np.degrees(np.abs(trace.euler[:, :2])).max() for trace in (program, clipped)]
    assert program.claimed and clipped.claimed
    assert tilt[0] <= 2.0 and tilt[1] >= 1.5 * tilt[0]
    assert all(trace.push_true[settled(trace)].mean() >= 0.95 * REACH_N for trace in (program, clipped))


@pytest.mark.slow
def test_with_the_printed_rows_clipping_loses_the_wall() -> None:
    """30.2 N unchecked, 0.2 N below the reach: noise clips rotors, and what clipping leaves is no level flight."""
    program, printed = press(30.2, 0.3, False), press(30.2, 0.3, False, law="paper", printed=True)
    assert program.claimed and program.push_true[settled(program)].mean() >= 0.95 * 30.2
    assert not printed.claimed and "crash" in printed.reason


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "push", "friction", "slide_s", "limit"),
    [
        ("qp", 22.0, 0.3, 5.0, 15.8),
        ("qp", 16.0, 0.8, 9.0, 8.7),
        ("paper", 22.0, 0.3, 5.0, 15.8),
        ("paper", 16.0, 0.8, 9.0, 8.7),
    ],
)
def test_a_sliding_push_beyond_reach_is_reduced_with_the_reason(
    law: str, push: float, friction: float, slide_s: float, limit: float
) -> None:
    trace = press(push, friction, law=law, slide_s=slide_s)
    ticks = np.flatnonzero(trace.phase == trace.phases.index("paint"))
    last = ticks[-250:]
    yaw = np.degrees(trace.euler[ticks, 2])
    rms, delivered = float(np.sqrt((yaw**2).mean())), float(trace.push_true[last].mean())
    speed = 250.0 / (len(last) - 1) * float(trace.position[last[0], 1] - trace.position[last[-1], 1])
    most = float(np.abs(yaw).max())
    print(f"{law} mu {friction:g}: {delivered:.2f} N, yaw {most:.2f} deg at most, {1e3 * speed:.0f} mm/s at the end")
    assert trace.claimed and 0.9 * limit <= delivered <= limit
    assert any("reduced" in text and "friction" in text and "along the travel" in text for text in notes(trace))
    assert rms <= 1.0
    if law == "qp":
        assert speed == pytest.approx(0.1, abs=0.02), "it slides in the end, and at the commanded speed"
