"""The environment: one control tick a step, in the closed loop that `sim.flight.closed_loop.fly` runs."""

from __future__ import annotations

import dataclasses
import math
import numbers
from collections.abc import Callable
from typing import Any, NamedTuple

import cv2
import gymnasium
import numpy as np
from gymnasium import spaces

import ibvs_qp
from ibvs_qp.config.errors import ConfigError, out_of_range, shown
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.estimation.line_tracking import SLOTS
from ibvs_qp.measurement import VERTICAL, Measurement, Reference, SensorFrame, channels
from ibvs_qp.pilot import Pilot
from sim.evaluate.truth import Assessment
from sim.flight.closed_loop import ClosedLoop
from sim.flight.options import FlightOptions, pilot_config, unsupervised
from sim.flight.preflight import check_job
from sim.flight.trace import TIME_OUT, Trace
from sim.gym_env.reward import PaintReward, RewardSettings
from sim.world.random_scene import EVALUATION, TUNING, random_scene
from sim.world.scene import Scene
from sim.world.worlds import DEFAULT_WORLD, in_world

_SENSED, _GIVEN = channels(SensorFrame), channels(Reference)
_ATTITUDE, _RATE, _FORCE, _WRENCH = (
    _SENSED[name].high for name in ("attitude", "angular_velocity", "specific_force", "wrench")
)
_PUSH, _TRAVEL, _SPEED = _GIVEN["push_force"].high, _GIVEN["velocity"].high, channels(Measurement)["velocity"].high
_NEAR, _FAR = _GIVEN["standoff"].low, _GIVEN["standoff"].high
#: Largest rho of a line [-], 84 degrees from the optical axis, and largest theta [rad].
_RHO, _THETA = 10.0, 2.0 * math.pi


class _Entry(NamedTuple):
    """Size, bounds and reading of an entry; without bounds it is a flag."""

    size: int
    low: float
    high: float
    read: Callable[[Pilot, SensorFrame], Any]


def _velocity(pilot: Pilot) -> np.ndarray | None:
    return None if pilot.measurement is None else pilot.measurement.velocity


def _flag(read: Callable[[Pilot, SensorFrame], bool]) -> _Entry:
    return _Entry(1, math.nan, math.nan, lambda pilot, frame: [read(pilot, frame)])


#: Entries by name; bounds are those of the channels. Commanded thrusts have the bounds of the vehicle.
_ENTRIES = {
    "attitude_wxyz": _Entry(4, -_ATTITUDE, _ATTITUDE, lambda _, frame: frame.attitude),
    "angular_velocity_rad_s": _Entry(3, -_RATE, _RATE, lambda _, frame: frame.angular_velocity),
    "specific_force_m_s2": _Entry(3, -_FORCE, _FORCE, lambda _, frame: frame.specific_force),
    "force_n": _Entry(3, -_WRENCH, _WRENCH, lambda _, frame: frame.wrench[:3]),
    "moment_n_m": _Entry(3, -_WRENCH, _WRENCH, lambda _, frame: frame.wrench[3:]),
    "velocity_known": _flag(lambda pilot, _: _velocity(pilot) is not None),
    "velocity_m_s": _Entry(3, -_SPEED, _SPEED, lambda pilot, _: np.zeros(3) if (v := _velocity(pilot)) is None else v),
    "wall_known": _flag(lambda pilot, _: pilot.contact.state.known),
    "wall_normal": _Entry(3, -1.0, 1.0, lambda pilot, _: pilot.contact.state.normal),
    "standoff_m": _Entry(1, _NEAR, _FAR, lambda pilot, _: [pilot.contact.state.distance]),
    "in_contact": _flag(lambda pilot, _: pilot.contact.state.in_contact),
    "push_n": _Entry(1, -_PUSH, _PUSH, lambda pilot, _: [pilot.contact.state.push]),
    "reference_contact": _flag(lambda pilot, _: pilot.reference.contact),
    "reference_push_n": _Entry(1, 0.0, _PUSH, lambda pilot, _: [pilot.reference.push_force]),
    "reference_standoff_m": _Entry(1, _NEAR, _FAR, lambda pilot, _: [pilot.reference.standoff]),
    "reference_velocity_m_s": _Entry(2, -_TRAVEL, _TRAVEL, lambda pilot, _: pilot.reference.velocity),
}
#: Entries of every line slot in the order of the columns of `_lines`, with their bounds; none for flags.
_LINES = {
    "line_mask": None,
    "line_vertical": None,
    "line_followed": None,
    "line_weight": (0.0, 1.0),
    "line_rho": (-_RHO, _RHO),
    "line_theta_rad": (-_THETA, _THETA),
    "line_reference_rho": (-_RHO, _RHO),
    "line_reference_theta_rad": (-_THETA, _THETA),
}


def observation_space(vehicle: VehicleParams) -> spaces.Dict:
    """Space of `observe` for a vehicle; entries have their units in their names."""
    bounds = {name: (each.size, each.low, each.high) for name, each in _ENTRIES.items()}
    bounds |= {name: (SLOTS, *(limits or (math.nan, math.nan))) for name, limits in _LINES.items()}
    bounds["thrusts_n"] = vehicle.geometry.count, 0.0, float(np.max(vehicle.thrust_max))
    made: dict[str, spaces.Space] = {
        name: spaces.MultiBinary(size) if math.isnan(low) else spaces.Box(low, high, (size,), np.float32)
        for name, (size, low, high) in bounds.items()
    }
    return spaces.Dict(made)


def observe(space: spaces.Dict, pilot: Pilot, frame: SensorFrame) -> dict[str, np.ndarray]:
    """Observation of a tick before its command, in new arrays.

    Args:
        space: Of `observation_space`; values are clipped to it.
        pilot: The pilot after the last tick.
        frame: Sensors of this tick.
    """
    values = {name: entry.read(pilot, frame) for name, entry in _ENTRIES.items()}
    last = pilot.setpoints.last
    values["thrusts_n"] = np.zeros(pilot.config.controller.vehicle.geometry.count) if last is None else last
    values |= zip(_LINES, _lines(pilot, frame.stamp_ns).T, strict=True)
    found = {}
    for name, each in space.items():
        array = np.array(values[name], each.dtype)
        found[name] = np.minimum(np.maximum(array, each.low), each.high) if isinstance(each, spaces.Box) else array
    return found


def _lines(pilot: Pilot, stamp_ns: int) -> np.ndarray:
    """Tracked lines, each in the slot that it keeps, (SLOTS, numbers); zeros in empty slots."""
    contact, measured, table = pilot.contact.state, pilot.measurement, np.zeros((SLOTS, len(_LINES)))
    if not contact.known or measured is None:
        return table
    # Guides of the strategy and their references are in the same order.
    guides = zip((line.track_id for line in measured.lines), pilot.reference.lines, strict=False)
    targets = {track: (target.rho, target.theta) for track, target in guides}
    for line in pilot.motion.lines.values():
        now = pilot.motion.feature(line, pilot.estimator.axes, contact.distance, stamp_ns)
        flags, target = (1.0, line.role == VERTICAL, line.track_id in targets), targets.get(line.track_id, (0.0, 0.0))
        table[line.slot] = (*flags, now.weight, now.rho, now.theta, *target)
    return table


#: Classes of `sim.gym_env.laws` by mode and law.
LAWS = {
    ("residual", "qp"): "ResidualQp",
    ("residual", "paper"): "ResidualPaper",
    ("thrusts", "qp"): "ThrustLaw",
    ("thrusts", "paper"): "ThrustLaw",
}
#: Largest residual of a rotor [N]: that of the learned policy in examples/own_controller.py.
RESIDUAL_N = 2.0
#: Scenes are drawn from so many numbers without a seed [-].
NUMBERS = 2**31
#: Rendered picture: width, radius of the tip [px], and colour of the tip (r, g, b).
PICTURE_PX, TIP_PX, TIP_COLOUR = 640, 5, (220, 30, 30)

Observation = dict[str, np.ndarray]


class PaintEnv(gymnasium.Env[Observation, np.ndarray]):
    """Paint the rows of a board: sensors and estimates in, rotor thrusts out, reward by the truth.

    Attributes:
        trace: The last flight after its end, for figures of merit and logs; None before.

    Args:
        action: "residual", added to the thrusts of the law, or "thrusts" alone [N], (n,).
        law: "qp" or "paper": the law, and the preset of the flight.
        family: Scenes are drawn from "tuning" or "evaluation" (`sim.world.random_scene`).
        scene: Flown instead of drawn scenes; the seed then varies start, noise and errors alone.
        world: Errors of drawn scenes.
        features: "geometric", the sensor model of lines, or "rendered" pictures, slower.
        supervised: Whether the pilot's supervisor may take over as in `fly`; None: with residuals only.
        residual_n: Largest residual [N].
        time_limit_s: Time-out of an episode [s]; None is that of `fly`.
        reward: Weights of the reward.
        render_mode: "rgb_array", the painted board with the true tip, or None.

    Raises:
        ConfigError: When an argument is refused, or the scene cannot be painted.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 250}  # noqa: RUF012  # control ticks [Hz]

    def __init__(
        self,
        action: str = "residual",
        law: str = "qp",
        *,
        family: str = TUNING,
        scene: Scene | None = None,
        world: str = DEFAULT_WORLD,
        features: str = "geometric",
        supervised: bool | None = None,
        residual_n: float = RESIDUAL_N,
        time_limit_s: float | None = None,
        reward: RewardSettings | None = None,
        render_mode: str | None = None,
    ) -> None:
        if (str(action), str(law)) not in LAWS:
            raise out_of_range("action, law", (action, law), "", f"allowed are {', '.join(map(str, LAWS))}")
        choices = {"family": (family, (TUNING, EVALUATION)), "features": (features, ("geometric", "rendered"))}
        for name, (value, allowed) in choices.items():
            if value not in allowed:
                raise out_of_range(name, value, "", f"allowed are {', '.join(allowed)}")
        for name, number, unit, most in (
            ("residual_n", residual_n, "N", 1e3),
            ("time_limit_s", time_limit_s, "s", 1e6),
        ):
            if number is not None and not (isinstance(number, numbers.Real) and 0.0 < float(number) <= most):
                raise out_of_range(name, number, unit, f"it must be above 0 and at most {most:g}")
        for name, value, kind in (("scene", scene, Scene), ("reward", reward, RewardSettings)):
            if value is not None and not isinstance(value, kind):
                raise ConfigError(f"{name}: {shown(value)} is no {kind.__name__}")
        in_world(Scene(), world)  # refuses an unknown one
        self.render_mode, self._scene, self._limit_s = render_mode, scene, time_limit_s
        self._family, self._world, self._weights = family, world, reward or RewardSettings()
        controller = f"sim.gym_env.laws:{LAWS[action, law]}"
        self._options = FlightOptions(law=law, controller=controller, features=features, video=False)
        self._config = ibvs_qp.preset(law)
        if scene is not None:
            check_job(scene, pilot_config(scene, self._options, self._config), features)
        if not (action == "residual" if supervised is None else supervised):
            self._config = unsupervised(self._config)
        vehicle = self._config.controller.vehicle
        self._limits = vehicle.thrust_min, vehicle.thrust_max
        if action == "residual":
            self._limits = np.full(vehicle.geometry.count, -residual_n), np.full(vehicle.geometry.count, residual_n)
        low, high = (side.astype(np.float32) for side in self._limits)
        self.action_space = spaces.Box(low, high, dtype=np.float32)
        self._space = observation_space(vehicle)
        self.observation_space: Any = self._space
        self.trace: Trace | None = None
        self._loop: ClosedLoop | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin a flight.

        Args:
            seed: Number of the scene, and seed of start, noise and errors; None draws one from `np_random`.
            options: None: the scene is that of the seed.

        Returns:
            The first observation, and info.

        Raises:
            ConfigError: With options.
        """
        if options:
            raise ConfigError(
                f"reset has no options, got {', '.join(map(str, options))}: the seed is that of the scene"
            )
        super().reset(seed=seed)
        self.close()
        number = int(self.np_random.integers(NUMBERS)) if seed is None else seed
        scene = self._scene or in_world(random_scene(number, self._family), self._world)
        self._loop = loop = ClosedLoop(scene, dataclasses.replace(self._options, seed=number), self._config)
        loop.limit_s = self._limit_s or loop.limit_s
        self._reward, self.trace = PaintReward(loop.world, self._weights), None
        return observe(self._space, loop.pilot, loop.sense()), self._info(loop) | {"scene": number}

    def step(self, action: np.ndarray) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Fly one control tick.

        Args:
            action: Thrusts or residual [N], (n,); clipped to the action space. One that is not finite becomes a hold.

        Returns:
            Observation, reward, whether the flight ended by a crash, a touchdown or its strategy, whether it timed
            out, and info.

        Raises:
            ConfigError: When the action has another shape.
        """
        loop = self._loop
        if loop is None or not loop.going:
            raise gymnasium.error.ResetNeeded("the flight is over, or has not begun: call reset")
        (low, high), thrusts = self._limits, np.array(action, float)
        if thrusts.shape != low.shape:
            raise ConfigError(f"action of shape {thrusts.shape} is refused: {low.shape} is needed")
        finite = bool(np.isfinite(thrusts).all())
        law: Any = loop.pilot.controller  # a class of `LAWS`
        law.action = np.clip(thrusts, low, high) if finite else np.full_like(thrusts, np.nan)
        loop.advance()
        terms, truncated = self._reward.terms(), loop.reason.startswith(TIME_OUT)
        observation = observe(self._space, loop.pilot, loop.sense())
        info = self._info(loop) | {"reward": terms, "refused": "" if finite else "action: not finite"}
        if not loop.going:
            self.trace = loop.trace()
            shortfall = Assessment(self.trace).shortfall or ""
            info |= {"completed": not shortfall, "shortfall": shortfall}
        return observation, sum(terms.values()), not loop.going and not truncated, truncated, info

    def _info(self, loop: ClosedLoop) -> dict[str, Any]:
        """State of the pilot, and truth, which does not belong to the observation."""
        plant, painter, command = loop.world.plant, loop.pilot.painter, loop.command
        return {
            "time_s": loop.time_s,
            "phase": painter.phase,
            "outcome": "" if command is None else str(command.outcome),
            "safety": "" if command is None else str(command.safety),
            "reason": loop.reason or painter.reason,
            "true_tip_m": plant.tip,
            "true_push_n": plant.contact_normal_force,
            "true_attitude_wxyz": plant.quaternion,
        }

    def render(self) -> Any:
        """The painted board and the tip in front of it, uint8 RGB (height, `PICTURE_PX`, 3); None without the mode."""
        if self.render_mode is None or self._loop is None:
            return None
        world, board = self._loop.world, self._loop.world.scene.board
        scale, (along, up) = PICTURE_PX / board.width_m, world.geometry.spot(*world.plant.tip_on_wall)
        size = PICTURE_PX, round(scale * board.height_m)
        picture = np.ascontiguousarray(cv2.resize(world.canvas.rgb, size, interpolation=cv2.INTER_AREA))
        place = round(scale * along), round(scale * (board.height_m - up))
        return cv2.circle(picture, place, TIP_PX, TIP_COLOUR, cv2.FILLED)

    def close(self) -> None:
        """End the flight; may be called again."""
        if self._loop is not None:
            self._loop.close()
        self._loop = None
