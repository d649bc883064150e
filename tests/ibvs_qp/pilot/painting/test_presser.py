"""A press and its slide on a synthetic wall."""

from __future__ import annotations

import pytest
from painted_wall import NEAR, TICK, PaintedWall, short

from ibvs_qp.pilot.painting.presser import Presser

HOLD, SLIDE = 3.0, 2.0


def press(slide_s: float = 0.0, **changes: object) -> PaintedWall:
    config = short(**{key: changes.pop(key) for key in ("pattern", "start") if key in changes})
    return PaintedWall(config, painter=Presser(config, HOLD, slide_s, 1.0), **changes)  # type: ignore[arg-type]


def times(world: PaintedWall) -> dict[str, float]:
    return {phase: time for time, phase, _ in world.painter.log}


def test_a_press_holds_from_the_touch_and_retreats() -> None:
    world = press()
    world.fly(60.0, until="press")
    while not world.in_contact:
        world.step()
    touched, place = world.time, world.tip.copy()
    world.fly(60.0)
    assert world.painter.finished and not world.painter.failed and world.painter.reason == "held, retreated"
    assert world.phases() == ["approach", "align", "press", "retreat", "done"]
    assert times(world)["retreat"] - touched == pytest.approx(HOLD, abs=3 * TICK)
    assert abs(world.tip - place).max() < 1e-3
    assert not world.ends and world.distance > world.config.retreat_m - 0.03


def test_a_press_plans_no_travel_and_a_slide_does() -> None:
    for slide_s, speed in ((0.0, 0.0), (SLIDE, 0.1)):
        world = press(slide_s)
        world.fly(60.0, until="press")
        right, down = world.step().travel
        assert (right, down) == pytest.approx((-speed, 0.0))


def test_the_hold_begins_with_the_touch_whatever_push_is_reached() -> None:
    world = press(push=1.0)
    world.fly(60.0)
    assert world.painter.finished and not world.painter.failed


@pytest.mark.parametrize(("kind", "start"), [("rows", "bottom-right"), ("columns", "top-left")])
def test_a_slide_follows_the_edge_at_its_speed_for_its_time(kind: str, start: str) -> None:
    world = press(SLIDE, pattern=kind, start=start)
    world.fly(60.0, until="paint")
    begin = world.tip.copy()
    world.fly(1.0)
    assert world.painter.expected_edge() is None, "a groove beside a slide is no paint"
    commands = world.fly(9.0, until="retreat")
    assert times(world)["retreat"] - times(world)["paint"] == pytest.approx(SLIDE, abs=2 * TICK)
    u, v = world.tip - begin
    ramp = 0.5 * world.config.speed_m_s / world.config.acceleration_m_s2
    assert (
        u == pytest.approx(world.config.speed_m_s * (SLIDE - ramp), abs=2 * TICK * world.config.speed_m_s)
        and abs(v) < 1e-3
    )
    assert all(command.contact for command in commands[:-1])
    world.fly(30.0)
    assert world.painter.finished and not world.painter.failed


def test_a_slide_waits_for_lost_contact() -> None:
    world = press(SLIDE)
    world.fly(60.0, until="paint")
    world.fly(0.5)
    world.contact_allowed = False
    world.fly(0.6)
    assert abs(world.step().velocity[0]) < 1e-9


def test_a_press_begins_where_the_tip_is_if_no_edge_stands_beside_it() -> None:
    world = press(hidden={NEAR})
    world.tip[0] = 0.1
    world.fly(60.0, until="press")
    assert world.painter.phase == "press" and "survey" not in world.phases()
    assert world.tip[0] == pytest.approx(0.1, abs=2e-3)


def test_a_touch_that_never_comes_times_out() -> None:
    world = press(contact_allowed=False)
    world.fly(60.0)
    assert world.painter.failed
    assert world.painter.reason.startswith("time-out after 25 s in press: contact, tip")


def test_an_abandoned_press_descends_and_is_no_failure() -> None:
    world = press()
    world.fly(60.0, until="press")
    world.fly(2.0)
    inputs_seen = {}
    step = world.painter.step
    world.painter.step = lambda inputs: inputs_seen.update(last=inputs) or step(inputs)  # type: ignore[method-assign]
    world.step()
    world.painter.abandon(inputs_seen["last"], "rotor 3 lost")
    command = world.step()
    assert not command.contact and command.velocity[1] == world.config.descend_speed_m_s
    world.fly(5.0)
    assert world.painter.finished and not world.painter.failed
    assert world.painter.reason.startswith("rotor 3 lost")


def test_reset_forgets_the_touch() -> None:
    world = press()
    world.fly(60.0)
    log = list(world.painter.log)
    world.painter.reset()
    again = PaintedWall(world.config, painter=world.painter)
    again.fly(60.0)
    assert again.painter.log == log
