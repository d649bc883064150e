"""When faults begin and end, what waits during a stall, and whole flights with faults."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.measurement import FeatureFrame, SensorFrame
from sim.evaluate.measures import fault_figures
from sim.experiments.scenes import near_wall, short_job
from sim.faults.camera import CameraLost
from sim.faults.clock import LoopStall
from sim.faults.fault import NoFault
from sim.faults.features import WrongLines
from sim.faults.force_torque import ForceTorqueZero
from sim.faults.rotors import ThrustLoss
from sim.faults.scenario import PLACES, WATCH_S, scenario, scenarios
from sim.faults.schedule import FaultSchedule
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions

ROTORS = ("a", "b", "c")


def flown(faults, ticks, touch_at=None, phases=None, seed=0):
    """What the pilot gets at every tick, and the ticks at which the flight must go on."""
    schedule, got, watching = FaultSchedule(faults, seed), [], []
    for tick in range(ticks):
        plant = SimpleNamespace(time_ns=tick * 4_000_000)
        in_contact = touch_at is not None and tick >= touch_at
        setpoints = SimpleNamespace(contact=SimpleNamespace(in_contact=in_contact))
        phase = "approach" if phases is None else phases(tick)
        pilot = SimpleNamespace(painter=SimpleNamespace(phase=phase), setpoints=setpoints)
        schedule.tick(SimpleNamespace(plant=plant), pilot)
        stamp = tick * 4_000_000
        picture = FeatureFrame(lines=(), plane=None, stamp_ns=stamp) if tick % 8 == 0 else None
        frame = SensorFrame(
            stamp_ns=stamp,
            attitude=np.array([1.0, 0.0, 0.0, 0.0]),
            angular_velocity=np.zeros(3),
            specific_force=np.zeros(3),
            wrench=np.ones(6),
            wrench_stamp_ns=stamp,
            features=picture,
        )
        got.append(schedule.seen(frame))
        watching.append(schedule.watching)
    return got, watching


def hit(got):
    """Ticks at which the wrench is zero."""
    return [tick for tick, frame in enumerate(got) if frame is not None and not frame.wrench.any()]


def test_a_fault_lasts_from_its_event_and_delay_for_its_duration():
    fault = ForceTorqueZero(after="touch", delay_s=0.04, duration_s=0.02)
    assert hit(flown((fault,), 60, touch_at=20)[0]) == list(range(30, 35))
    in_phase = dataclasses.replace(fault, after="align")
    assert hit(flown((in_phase,), 60, phases=lambda tick: "align" if tick >= 7 else "start")[0]) == list(range(17, 22))
    permanent = dataclasses.replace(fault, after="start", duration_s=None)
    assert hit(flown((permanent,), 60)[0]) == list(range(10, 60))


def test_the_flight_is_watched_after_a_fault_and_not_before():
    fault = ForceTorqueZero(after="start", delay_s=0.04, duration_s=0.02, watch_s=0.08)
    _, watching = flown((fault,), 60)
    assert [tick for tick, goes_on in enumerate(watching) if goes_on] == list(range(10, 30))


def test_the_newest_picture_waits_for_the_end_of_a_stall():
    got, _ = flown((LoopStall(after="start", delay_s=0.012, duration_s=0.1),), 60)
    assert [tick for tick, frame in enumerate(got) if frame is None] == list(range(3, 28))
    assert got[28].features.stamp_ns == 24 * 4_000_000 and got[28].stamp_ns == 28 * 4_000_000
    assert got[29].features is None


def test_several_faults_act_together():
    faults = (CameraLost(after="start", delay_s=0.0), ForceTorqueZero(after="start", delay_s=0.0))
    got, _ = flown(faults, 20)
    assert len(hit(got)) == 20 and all(frame.features is None for frame in got)


def test_every_row_of_the_matrix_is_read_and_can_be_flown():
    rows = scenarios()
    assert len(rows) > 60 and len({row.name for row in rows}) == len(rows)
    for row in rows:
        assert row.faults and row.places, row.name
        for place in row.places:
            for fault in row.flown(place, 1, ROTORS):
                assert fault.watch_s == WATCH_S
                assert getattr(fault, "rotor", "") != "each"
                hash(fault)


def test_rows_strike_in_contact_and_free_and_each_rotor_has_its_turn():
    row = scenario(
        {
            "name": "x",
            "faults": [{"kind": "RotorStuck", "rotor": "each", "thrust_n": 8.0}],
            "contact": {"reach": "retreat"},
            "free": {"after": "press", "delay_s": 1.0},
        }
    )
    assert [row.flown("contact", seed, ROTORS)[0].rotor for seed in range(4)] == ["a", "b", "c", "a"]
    assert (row.flown("contact", 0, ROTORS)[0].after, row.flown("contact", 0, ROTORS)[0].delay_s) == PLACES["contact"]
    assert (row.flown("free", 0, ROTORS)[0].after, row.flown("free", 0, ROTORS)[0].delay_s) == ("press", 1.0)


@pytest.mark.parametrize(
    ("row", "named"),
    [
        ({"name": "x", "faults": [{"kind": "Nonsense"}]}, "Nonsense"),
        ({"name": "x", "faults": [{"kind": "WrongLines", "share": 2.0}]}, "share"),
        ({"name": "x", "contact": {"reach": "heaven"}}, "reach"),
        ({"name": "x", "contact": {"reached": "retreat"}}, "reached"),
    ],
)
def test_bad_rows_are_refused_by_name(row, named):
    with pytest.raises(ConfigError, match=named):
        scenario(row)


def test_bad_faults_are_refused_at_construction():
    with pytest.raises(ConfigError, match="delay_s"):
        CameraLost(delay_s=-1.0)
    with pytest.raises(ConfigError, match="theta_deg"):
        WrongLines(theta_deg=400.0)


OPTIONS = FlightOptions(features="geometric", video=False)


@pytest.mark.slow
def test_a_watched_flight_goes_on_after_the_end_of_the_strategy_and_is_completed():
    fault = NoFault(after="retreat", delay_s=0.0, watch_s=4.0)
    trace = fly(short_job(0.2, rows=1), OPTIONS, faults=(fault,))
    figures = fault_figures(trace)
    assert trace.claimed and figures["end_s"] - figures["fault_s"] == pytest.approx(4.0, abs=0.01)
    assert trace.phases[trace.phase[-1]] == "done"


def test_a_slow_touchdown_ends_the_flight_as_landed():
    low = near_wall(board={"bottom_m": 0.5}, start={"down_m": 0.35})
    trace = fly(low, OPTIONS, faults=(ThrustLoss(after="start", delay_s=0.0, share=0.7),))
    assert trace.reason == "landed" and not trace.claimed
    assert fault_figures(trace)["landed"] == 1.0 and trace.t[-1] < 2.0


def test_a_stalled_loop_leaves_the_last_command_in_force_and_the_log_whole():
    trace = fly(near_wall(board={"bottom_m": 0.5}, start={"down_m": 0.35}), OPTIONS, faults=(
        LoopStall(after="start", delay_s=0.04, duration_s=0.2),
        ThrustLoss(after="start", delay_s=0.3, share=0.7),
    ))  # fmt: skip
    stalled = (trace.t >= 0.04) & (trace.t < 0.24)
    assert np.array_equal(trace.thrusts[stalled], np.tile(trace.thrusts[9], (np.count_nonzero(stalled), 1)))
    assert np.diff(trace.t) == pytest.approx(0.004)
    assert not np.array_equal(trace.thrusts[60], trace.thrusts[9])
