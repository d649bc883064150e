"""Settings: refusals and their words, and the way to TOML and back."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from controller_scenes import TICK_NS, measured
from hypothesis import given, settings
from hypothesis import strategies as st

from ibvs_qp.analytic import analytic_setpoints
from ibvs_qp.config import (
    LONGEST_TICK,
    ContactSettings,
    ControllerConfig,
    Gains,
    LimitSettings,
    SolverSettings,
    Weights,
)
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import choice, dump_toml, from_dict, load_toml, setting, validate
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import Reference
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.pilot.painting.config import LineGates, PaintingConfig

TREES = [
    ControllerConfig,
    PilotConfig,
    PaintingConfig,
    LineGates,
    VehicleParams,
    Gains,
    Weights,
    LimitSettings,
    SolverSettings,
]


def refusal(make: object) -> str:
    with pytest.raises(ConfigError) as caught:
        make()  # type: ignore[operator]
    text = str(caught.value)
    assert "\n" not in text
    return text


@pytest.mark.parametrize("kind", TREES)
def test_defaults_pass_their_own_ranges_and_survive_toml(kind: type, tmp_path: Path) -> None:
    file = tmp_path / "preset.toml"
    file.write_text(dump_toml(kind()), encoding="utf-8")
    assert load_toml(kind, file) == kind()


@settings(deadline=None)
@given(st.floats(0.0, 200.0), st.floats(0.005, 0.5), st.booleans(), st.integers(1, 16), st.floats(0.6, 50.0))
def test_every_value_survives_toml_bit_identically(
    kp: float, speed: float, flag: bool, slots: int, mass: float
) -> None:
    config = ControllerConfig(
        gains=Gains(line_kp=kp),
        contact=ContactSettings(approach_speed_m_s=speed),
        vehicle=VehicleParams(mass_kg=mass, thrust_max_n=(52.56, 40.0, 30.0, 52.56, 52.56, 20.0)),
        barriers=flag,
        line_slots=slots,
    )
    import tomllib

    assert from_dict(ControllerConfig, tomllib.loads(config.to_toml())) == config


@pytest.mark.parametrize("kind", TREES)
def test_every_number_refuses_what_lies_outside_its_range(kind: type) -> None:
    for field in dataclasses.fields(kind):
        meta = field.metadata
        default = field.default
        if "low" not in meta or isinstance(default, (bool, str, tuple)) or default is None:
            continue
        for bad in (meta["low"] - 1.0, meta["high"] + 1.0, math.nan, math.inf, -math.inf):
            if math.isinf(meta["low"]) and bad == meta["low"] - 1.0:
                continue
            value = int(bad) if isinstance(default, int) and math.isfinite(bad) else bad
            text = refusal(lambda kind=kind, name=field.name, value=value: kind(**{name: value}))
            assert field.name in text and repr(value) in text and meta["unit"] in text
            assert f"[{meta['low']:g}, {meta['high']:g}]" in text


def test_words_of_a_refusal() -> None:
    assert refusal(lambda: Gains(yaw_kp=500.0)) == "yaw_kp = 500.0 1/s^2 is refused: allowed is [0, 400] 1/s^2"
    text = refusal(lambda: from_dict(ControllerConfig, {"gains": {"yaw_kp": -1.0}}))
    assert text == "gains.yaw_kp = -1.0 1/s^2 is refused: allowed is [0, 400] 1/s^2"
    nested = refusal(lambda: from_dict(PilotConfig, {"controller": {"contact": {"ramp_s": 99.0}}}))
    assert nested == "controller.contact.ramp_s = 99.0 s is refused: allowed is [0.05, 10] s"
    assert refusal(lambda: PilotConfig(law="best")) == "law = 'best' is refused: allowed are qp, paper"


def test_unknown_keys_are_named_with_the_nearest_known_one() -> None:
    text = refusal(lambda: from_dict(PilotConfig, {"controller": {"gains": {"line_pk": 1.0}}}))
    assert text == "unknown key 'controller.gains.line_pk'; did you mean 'line_kp'?"
    far = refusal(lambda: from_dict(PilotConfig, {"zzz": 1}))
    assert far.startswith("unknown key 'zzz'; known keys: controller, ")


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"gains": 3}, "gains must be a table, got 3"),
        ({"gains": {"line_kp": "12"}}, "gains.line_kp = '12' is refused: a float is needed"),
        ({"gains": {"line_kp": True}}, "gains.line_kp = True is refused: a float is needed"),
        ({"line_slots": 2.5}, "line_slots = 2.5 is refused: a int is needed"),
        ({"barriers": 1}, "barriers = 1 is refused: a bool is needed"),
        ({"vehicle": {"tip_position_m": [0.7, 0.0]}}, "vehicle.tip_position_m = [0.7, 0.0] is refused: a list of 3"),
        ({"vehicle": {"tip_position_m": 0.7}}, "vehicle.tip_position_m = 0.7 is refused: a list is needed"),
        ({"vehicle": {"thrust_max_n": [50.0, 50.0]}}, "vehicle.thrust_max_n = (50.0, 50.0) N is refused"),
        ({"vehicle": {"thrust_min_n": 60.0}}, "must lie below thrust_max_n on every rotor"),
        ({"vehicle": {"inertia_kg_m2": [0.2, 0.3, -1.0]}}, "vehicle.inertia_kg_m2 = (0.2, 0.3, -1.0) kg m^2"),
        ({"vehicle": {"geometry": {"rotors": [], "circle_radius_m": 1.0}}}, "vehicle.geometry"),
        (
            {"vehicle": {"geometry": {"rotors": [], "circle_radius_m": 1.0, "tilt_deg": 9.0, "torque_ratio_m": 0.1}}},
            "vehicle.geometry: rotors: 0 given",
        ),
    ],
)
def test_wrong_types_and_shapes_are_refused_in_one_line(table: dict, words: str) -> None:
    assert words in refusal(lambda: from_dict(ControllerConfig, table))


@pytest.mark.parametrize("bad", ["12", None, True, [1.0], 1 + 0j])
def test_a_number_given_in_code_must_be_a_number(bad: object) -> None:
    assert "line_kp" in refusal(lambda: Gains(line_kp=bad))  # type: ignore[arg-type]


@pytest.mark.parametrize("bad", [2.5, "2", True, None])
def test_a_count_given_in_code_must_be_whole(bad: object) -> None:
    assert "line_slots" in refusal(lambda: ControllerConfig(line_slots=bad))  # type: ignore[arg-type]


def test_missing_and_broken_files_are_named(tmp_path: Path) -> None:
    missing, broken, binary = tmp_path / "none.toml", tmp_path / "broken.toml", tmp_path / "binary.toml"
    broken.write_text("[gains\n", encoding="utf-8")
    binary.write_bytes(b"\xff\xfe")
    assert refusal(lambda: load_toml(ControllerConfig, missing)).startswith(f"cannot read {missing}: ")
    assert refusal(lambda: load_toml(ControllerConfig, broken)).startswith(f"{broken} is not valid TOML")
    assert refusal(lambda: load_toml(ControllerConfig, binary)).startswith(f"{binary} is not valid TOML")
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("tick_s = 9.0\n", encoding="utf-8")
    assert refusal(lambda: ControllerConfig.from_toml(wrong)).startswith(f"{wrong}: tick_s = 9.0 s is refused")


@pytest.mark.parametrize(
    ("kind", "values", "words"),
    [
        (ContactSettings, {"depth_min_m": 0.6, "depth_max_m": 0.6}, "must lie below depth_max_m = 0.6 m"),
        (ContactSettings, {"depth_min_m": 0.63, "depth_max_m": 0.53}, "must lie below depth_max_m = 0.53 m"),
        (ContactSettings, {"touch_distance_m": 0.15}, "must lie below close_distance_m = 0.1 m"),
        (ContactSettings, {"loss_force_n": 0.6}, "must lie below touch_force_n = 0.5 N"),
        (VehicleParams, {"tool_mass_kg": 5.0, "mass_kg": 4.0}, "must lie below mass_kg = 4.0 kg"),
    ],
)
def test_pairs_in_the_wrong_order_are_refused(kind: type, values: dict[str, float], words: str) -> None:
    text = refusal(lambda: kind(**values))
    first, value = next(iter(values.items()))
    assert text.startswith(f"{first} = {value!r} ") and words in text


def test_a_push_that_could_never_begin_is_refused() -> None:
    """Lambda depends on the distance of the camera, and in contact the arm keeps that: half a metre, or more."""
    short = ContactSettings(depth_min_m=0.53, depth_max_m=0.63)
    text = refusal(lambda: from_dict(ControllerConfig, {"contact": {"depth_min_m": 0.2, "depth_max_m": 0.4}}))
    assert text.startswith("contact.depth_min_m = 0.2 m is refused: allowed is at least 0.5 m")
    long_arm = VehicleParams(tip_position_m=(0.9, 0.0, 0.0))
    assert "at least 0.7 m" in refusal(lambda: ControllerConfig(vehicle=long_arm, contact=short))
    ControllerConfig(vehicle=long_arm, contact=ContactSettings(depth_min_m=0.73, depth_max_m=0.83))


def test_optional_and_tuple_fields() -> None:
    @dataclasses.dataclass(frozen=True, kw_only=True)
    class Sample:
        maybe: float | None = setting(None, "may be absent", unit="m", low=0.0, high=1.0)
        pair: tuple[float, ...] = setting((0.1, 0.2), "any length", low=0.0, high=1.0)
        word: str = choice("a", "a word", ("a", "b"))

        def __post_init__(self) -> None:
            validate(self)

    assert "maybe" not in dump_toml(Sample())
    assert Sample(maybe=0.5).maybe == 0.5
    assert "maybe = 2.0 m" in refusal(lambda: Sample(maybe=2.0))
    assert "pair" in refusal(lambda: Sample(pair=(0.1, 2.0)))
    assert "word = 'c'" in refusal(lambda: Sample(word="c"))


def test_the_longest_tick_allowed_is_integrated_in_full() -> None:
    """A controller set to a longer one would fall behind time: its filters take any more for a pause."""
    low, high = 0.0005, LONGEST_TICK
    assert (
        refusal(lambda: ControllerConfig(tick_s=0.05))
        == f"tick_s = 0.05 s is refused: allowed is [{low:g}, {high:g}] s"
    )
    config = ControllerConfig(tick_s=LONGEST_TICK)
    setpoints, ticks, step = analytic_setpoints(config), 12, round(LONGEST_TICK * 1e9)
    for tick in range(ticks):  # carried along at 1 m/s, and the accelerometer says 1 m/s^2 towards the wall
        felt = np.array([1.0, 0.0, -9.81])
        setpoints.update(
            measured(0, stamp_ns=(tick + 1) * step, specific_force=felt, plane_stamp_ns=TICK_NS), Reference()
        )
    assert setpoints.step.inputs["dt"][0] == pytest.approx(LONGEST_TICK)
    assert -setpoints.contact.rate == pytest.approx((ticks - 1) * LONGEST_TICK, rel=0.1)
