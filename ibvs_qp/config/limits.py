"""Bounds, slack weights and switches of the limits: unit, range and reason of every number."""

from __future__ import annotations

from dataclasses import dataclass

from ibvs_qp.config.settings import setting, validate


@dataclass(frozen=True, kw_only=True)
class LimitSettings:
    """Bounds of the soft limits, weights of their slack per squared unit, and switches.

    The program lets a demand beyond a bound pass by the fraction weight / (weight + slack weight), so compare a slack
    weight with the weights of the rows that pull against it. Quoted figures are from flights of the small vehicle in
    `tests/ibvs_qp/limits/test_barriers.py`, which asserts the main ones.
    """

    tilt_deg: float = setting(
        1.0,
        "zero-tilt bound on roll and pitch",
        unit="deg",
        why="a job may tilt by 2 deg at its worst; painting in calm air takes 0.12 deg rms",
        low=0.05,
        high=45.0,
    )
    tilt_slack_weight: float = setting(
        4000.0,
        "slack weight of the tilt barriers",
        unit="s^4/rad^2",
        why="ten times the level rows. A pitch rate of 0.25 rad/s before two lines peaks at 1.08 deg; at a tenth of "
        "the weight at 1.15, at ten times at 1.06",
        low=1e-3,
        high=1e8,
    )
    tilt_rate_1_s: float = setting(
        8.0,
        "poles of the tilt barriers: how fast the bound may be approached",
        unit="1/s",
        why="half of what the motors' 0.057 s follow, 17 1/s. A pitch rate of 0.25 rad/s peaks at 1.08 deg with 8, at "
        "1.23 with 4; a tumble that no task levels at 0.8 deg with 8, at 4 deg with 32",
        low=0.1,
        high=100.0,
    )
    yaw_deg: float = setting(
        10.0,
        "yaw bound",
        unit="deg",
        why="half of the 19 deg at which a front propeller strikes the wall",
        low=0.5,
        high=45.0,
    )
    yaw_slack_weight: float = setting(
        1000.0,
        "slack weight of the yaw barrier",
        unit="s^4/rad^2",
        why="above every row that turns the vehicle; the yaw row itself pulls back, so the value hardly matters: a "
        "turn of 0.7 rad/s peaks at 7.7 deg for any weight from 33 to 1e5",
        low=1e-3,
        high=1e8,
    )
    yaw_rate_1_s: float = setting(
        5.0,
        "poles of the yaw barrier",
        unit="1/s",
        why="a third of what the motors follow: a turn of 0.7 rad/s that no task stops peaks at 7.7 deg, with 20 1/s "
        "at 16",
        low=0.1,
        high=100.0,
    )
    view_down: float = setting(
        0.35, "largest |rho| of a level guide", why="the picture ends at 0.384", low=0.01, high=10.0
    )
    view_right: float = setting(
        0.48, "largest |rho| of an upright guide", why="the picture ends at 0.512", low=0.01, high=10.0
    )
    view_slack_weight: float = setting(
        4e4,
        "slack weight of the line-in-view barriers",
        unit="s^4",
        why="400 times the line rows that pull a guide out. Told to take it to 0.60 they hold it at 0.356; at a tenth "
        "of the weight at 0.417, out of the picture, at ten times at 0.350",
        low=1e-3,
        high=1e8,
    )
    view_rate_1_s: float = setting(
        2.0,
        "poles of the line-in-view barriers",
        unit="1/s",
        why="below the line loop's 5 1/s; the value hardly matters: a guide told to go to 0.60 stays at 0.356 with 1 "
        "and 2, at 0.352 with 4",
        low=0.1,
        high=100.0,
    )
    push_ceiling_ratio: float = setting(
        1.5,
        "push ceiling over the push reference",
        why="2.5 N above a push of 5 N are three times what gusts of 2 N rms leave, 0.87 N rms",
        low=1.0,
        high=100.0,
    )
    push_quiet_m_s: float = setting(
        0.005,
        "closing speed that the push ceiling takes for noise of the estimate",
        unit="m/s",
        why="0.005 m/s are 2.4 N at 10 kN/m: answered, the noise made the ceiling bind in 13 % of the ticks of a press "
        "there",
        low=0.0,
        high=1.0,
    )
    push_slack_weight: float = setting(
        40.0,
        "slack weight of the push ceiling",
        unit="1/N^2",
        why="80 times the push row. With a force gain six times too high 5 N asked peak at 7.07 N; at a tenth of the "
        "weight at 7.14, at ten times at 7.06",
        low=1e-3,
        high=1e8,
    )
    approach_speed_ratio: float = setting(
        1.5,
        "closing speed over that of the approach",
        why="with 1.0 the barrier binds in 82 % of the first 3 s from 0.12 m away and the tip has not arrived by then, "
        "with 1.5 in 5 % and it has",
        low=1.0,
        high=100.0,
    )
    approach_rate_1_s: float = setting(
        10.0,
        "pole of the approach-speed barrier",
        unit="1/s",
        why="thrown at the wall with 0.3 m/s from 0.12 m, its own damping cut to a tenth, the tip does not strike; "
        "with 5 it does with 1.7 N, with 2.5 with 5.6 N",
        low=0.1,
        high=100.0,
    )
    approach_slack_weight: float = setting(
        4000.0,
        "slack weight of the approach-speed barrier",
        unit="s^4/m^2",
        why="220 times the stand-off row, 0.5 per N^2 at 6 kg. Thrown at the wall with 0.3 m/s the tip does not "
        "strike, at a thirtieth of the weight with 0.6 N",
        low=1e-3,
        high=1e8,
    )
    tilt_barrier: bool = setting(True, "zero-tilt barriers on roll and pitch")
    yaw_barrier: bool = setting(True, "yaw barrier")
    view_barrier: bool = setting(True, "line-in-view barriers")
    push_barrier: bool = setting(True, "push-force ceiling")
    approach_barrier: bool = setting(True, "approach-speed barrier")
    hard_barriers: bool = setting(
        False, "no slack on any barrier: the program may have no solution, and the conflicting rows are named then"
    )

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)
