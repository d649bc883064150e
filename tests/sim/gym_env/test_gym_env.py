"""The Gymnasium environment: interface, seeds, equality with `fly`, ends, refused actions, reward."""

from __future__ import annotations

import runpy
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pytest
from closed_loop_rigs import short_scene
from gymnasium.utils.env_checker import check_env

import sim.gym_env
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.estimation.line_tracking import SLOTS
from sim.evaluate.paint_plan import nominal_plan
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions
from sim.gym_env.environment import RESIDUAL_N, PaintEnv
from sim.gym_env.reward import PaintReward, RewardSettings
from sim.world.board import BoardGeometry
from sim.world.random_scene import TUNING, random_scene
from sim.world.worlds import DEFAULT_WORLD, in_world

ROOT = Path(__file__).parents[3]
SCENE = short_scene(stroke_m=0.2, rows=1)
ZERO, TICK_S = np.zeros(6), 0.004


def made(**options: Any) -> PaintEnv:
    env = gymnasium.make(sim.gym_env.ENVIRONMENT, **options).unwrapped
    assert isinstance(env, PaintEnv)
    return env


def commanded(env: Any) -> np.ndarray:
    return env._loop.command.thrusts


@pytest.mark.filterwarnings("ignore:.*symmetric and normalized space")
@pytest.mark.parametrize("action", ["residual", "thrusts"])
def test_gymnasium_finds_no_fault(action: str) -> None:
    check_env(made(action=action, scene=SCENE), skip_render_check=False)


def test_the_name_with_its_module_needs_no_import() -> None:
    code = "import gymnasium as g; assert 'ibvs_qp/Paint-v0' not in g.registry; g.make('sim.gym_env:ibvs_qp/Paint-v0')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr


def test_a_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    with pytest.raises(ConfigError, match="extra gym"):
        runpy.run_path(str(ROOT / "sim" / "gym_env" / "__init__.py"))


def test_same_seed_same_bytes() -> None:
    def episode(env: PaintEnv, seed: int | None) -> bytes:
        env.action_space.seed(0)
        seen = [env.reset(seed=seed)[0], *(env.step(env.action_space.sample())[0] for _ in range(50))]
        return b"".join(value.tobytes() for each in seen for value in each.values())

    env, other = made(), made()
    first, second = episode(env, 3), episode(env, None)
    assert (episode(other, 3), episode(other, None)) == (first, second)
    assert len({first, second, episode(env, 4)}) == 3
    assert env._loop is not None and env._loop.world.scene == in_world(random_scene(4, TUNING), DEFAULT_WORLD)


@pytest.mark.parametrize("law", ["qp", "paper"])
def test_zero_residual_is_the_flight_of_the_law(law: str) -> None:
    def stop(*_: object) -> None:  # at the first report
        raise KeyboardInterrupt

    trace, env = fly(SCENE, FlightOptions(law=law, seed=2, features="geometric"), stop), made(law=law, scene=SCENE)
    env.reset(seed=2)
    for thrusts in trace.thrusts:
        env.step(ZERO)
        assert commanded(env).tobytes() == thrusts.tobytes()
    assert len(trace.thrusts) == 125


@pytest.mark.parametrize("law", ["qp", "paper"])
def test_residual_adds_and_is_clipped(law: str) -> None:
    env = made(law=law, scene=SCENE)
    env.reset(seed=1)
    env.step(ZERO)
    plain = commanded(env)
    env.reset(seed=1)
    env.step(np.array([10.0 * RESIDUAL_N, 0.0, 0.0, -0.5, 0.0, 0.0]))
    assert commanded(env) == pytest.approx(np.add(plain, (RESIDUAL_N, 0.0, 0.0, -0.5, 0.0, 0.0)), abs=1e-12)


def test_thrusts_reach_the_plant_and_are_clipped() -> None:
    law, env = made(scene=SCENE), made(action="thrusts", scene=SCENE)
    law.reset(seed=1), env.reset(seed=1)
    for _ in range(100):
        seen, other = law.step(ZERO)[0], env.step(commanded(law))[0]
        assert commanded(env).tobytes() == commanded(law).tobytes()
        assert other["specific_force_m_s2"].tobytes() == seen["specific_force_m_s2"].tobytes()
    last = commanded(env)
    env.step(np.full(6, 1e9))
    assert commanded(env) == pytest.approx(np.minimum(last + 500.0 * TICK_S, 52.56))  # rate and limit of the vehicle


def test_observation_has_fixed_slots_and_a_mask() -> None:
    env = made(scene=SCENE)
    seen, _ = env.reset(seed=0)
    assert not seen["line_mask"].any() and not seen["wall_known"]
    for _ in range(250):
        seen, _, _, _, info = env.step(ZERO)
        assert seen in env.observation_space
    assert seen["wall_known"].all() and 2 <= seen["line_mask"].sum() <= SLOTS
    assert seen["standoff_m"][0] == pytest.approx(-info["true_tip_m"][0], abs=0.01)
    lines = [value for name, value in seen.items() if name.startswith("line_")]
    assert all(value.shape == (SLOTS,) and not value[seen["line_mask"] == 0].any() for value in lines)
    assert not any("true" in name for name in seen)


def test_a_crash_terminates() -> None:
    env = made(action="thrusts", scene=SCENE)
    env.reset(seed=0)
    ticks, terminated = 0, False
    while not terminated and ticks < 400:
        _, reward, terminated, truncated, info = env.step(ZERO)
        ticks += 1
    assert terminated and not truncated and not info["completed"]
    assert info["reason"].startswith("crash") and info["reward"]["crash"] == reward == -RewardSettings().crash
    assert env.trace is not None and len(env.trace.t) == ticks
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(ZERO)


def test_time_out_truncates() -> None:
    env = made(scene=SCENE, time_limit_s=0.1)
    env.reset(seed=0)
    assert [env.step(ZERO)[2:4] for _ in range(26)] == [(False, False)] * 25 + [(False, True)]


@pytest.mark.parametrize("options", [{"law": "qp"}, {"law": "paper"}, {"action": "thrusts"}])
def test_an_action_that_is_not_finite_becomes_a_hold(options: dict[str, str]) -> None:
    env = made(scene=SCENE, **options)
    env.reset(seed=0)
    for value in (np.nan, np.inf):
        seen, reward, terminated, _, info = env.step(np.full(6, value))
        assert info["refused"] == "action: not finite" and info["outcome"] == "hold"
        assert np.isfinite(reward) and not terminated and seen in env.observation_space
    with pytest.raises(ConfigError, match="shape"):
        env.step(np.zeros(5))


def test_wrong_arguments_are_refused() -> None:
    wrong: list[dict[str, Any]] = [
        *({name: "x"} for name in ("action", "law", "family", "world", "features")),
        {"residual_n": -1.0},
        {"time_limit_s": 0.0},
        {"scene": short_scene(stroke_m=0.2, rows=20)},
    ]
    for options in wrong:
        with pytest.raises(ConfigError):
            made(**options)
    with pytest.raises(ConfigError, match="no options, got scene"):
        made().reset(seed=1, options={"scene": 3})


def test_reward_of_a_perfect_tour_and_of_a_dab_elsewhere() -> None:
    board, weights = BoardGeometry(SCENE), RewardSettings()
    plant = SimpleNamespace(tick_ns=4_000_000, crashed=None, on_board=True, contact_normal_force=SCENE.paint.push_n)
    world: Any = SimpleNamespace(scene=SCENE, geometry=board, plant=plant)
    reward, total = PaintReward(world, weights), np.zeros(5)
    for spot in np.linspace(*nominal_plan(SCENE).polyline[[0, -1]], 200):
        plant.tip_on_wall = board.point(*spot)
        total += list(reward.terms().values())
    assert total == pytest.approx([100.0, 0.0, 0.0, 0.0, 0.0], abs=1e-6)
    plant.tip_on_wall = board.point(0.15, 0.4)
    terms = reward.terms()
    assert terms["paint"] == 0.0 and terms["stray"] < 0.0 and terms["path"] == -weights.path * TICK_S


@pytest.mark.slow
def test_example_prints_a_row_of_every_policy() -> None:
    command = [sys.executable, str(ROOT / "examples" / "gym_policies.py"), "0.2"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=180)
    assert [row[:10].strip() for row in done.stdout.splitlines()] == ["policy", "random", "PD hover", "qp", "paper"], (
        done.stderr
    )


@pytest.mark.slow
@pytest.mark.parametrize("law", ["qp", "paper"])
def test_zero_residual_paints_as_the_law(law: str) -> None:
    env = made(law=law, scene=SCENE)
    env.reset(seed=3)
    total, over = 0.0, False
    while not over:
        _, reward, terminated, truncated, info = env.step(ZERO)
        total, over = total + reward, terminated or truncated
    assert info["completed"] and terminated and total > 80.0
    trace = fly(SCENE, FlightOptions(law=law, seed=3, features="geometric", video=False))
    assert env.trace is not None and trace.claimed
    assert env.trace.thrusts.tobytes() == trace.thrusts.tobytes()
