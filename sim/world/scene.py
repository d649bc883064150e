"""A scene: board, wall, paint job, start, and the plant's truth, as one TOML file (unknown key = error)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

from ibvs_qp.config.errors import out_of_range
from ibvs_qp.config.settings import Checked, choice, load_toml, setting
from ibvs_qp.measurement import SensorFrame, channels
from ibvs_qp.pilot.painting.pattern import CORNERS, FILL, PATTERNS
from sim.world.errors import WorldErrors
from sim.world.plant_scene import PlantScene
from sim.world.surfaces import KINDS, SIDES

Color = tuple[int, int, int]
#: Steepest wall: angle of its normal to the horizon [deg].
STEEPEST_DEG = 15.0
#: End of a board around a vertical axis: a quarter of the circumference from its middle [deg]; a chart ends at a half.
WIDEST_DEG = 90.0
#: Nominal rates and delays of the sensors.
_SENSORS = channels(SensorFrame)
_IMAGE, _WRENCH, _INERTIAL = _SENSORS["image"], _SENSORS["wrench"], _SENSORS["specific_force"]
_CLIMB = _SENSORS["height_rate"]


@dataclass(frozen=True, kw_only=True)
class BoardScene(Checked):
    """The board that is painted, in front of the wall."""

    width_m: float = setting(1.40, "width of the board", unit="m", low=0.2, high=20.0)
    height_m: float = setting(0.60, "height of the board", unit="m", low=0.1, high=10.0)
    bottom_m: float = setting(1.20, "height of the bottom edge above the ground", unit="m", low=0.5, high=50.0)
    slope_deg: float = setting(
        0.0, "turn in its own plane, + clockwise in the picture", unit="deg", low=-10.0, high=10.0
    )
    gap_m: float = setting(0.05, "distance of the board's face in front of the wall", unit="m", low=0.005, high=1.0)
    color: Color = setting((236, 236, 230), "board colour", low=0, high=255)
    clutter: int = setting(4, "distracting objects on and around the board", low=0, high=100)
    texture_seed: int = setting(0, "seed of textures and clutter, mixed with the flight's seed", low=0, high=2**31 - 1)


@dataclass(frozen=True, kw_only=True)
class SurfaceScene(Checked):
    """The shape of wall and board; a plane has no radius."""

    kind: str = choice("plane", "shape", tuple(KINDS))
    lean_deg: float = setting(
        0.0,
        "lean in the middle of the board, + with the top away from the vehicle",
        unit="deg",
        low=-STEEPEST_DEG,
        high=STEEPEST_DEG,
    )
    radius_m: float = setting(3.0, "radius", unit="m", low=1.5, high=1000.0)
    axis: str = choice("vertical", "direction of the axis of a cylinder", ("vertical", "horizontal"))
    side: str = choice("convex", "side of a cylinder that is painted: outside, or inside as in a tank", SIDES)


@dataclass(frozen=True, kw_only=True)
class WallScene(Checked):
    """The wall and the contact between brush and board."""

    color: Color = setting((150, 120, 100), "wall colour", low=0, high=255)
    texture_seed: int = setting(0, "seed of the wall texture", low=0, high=2**31 - 1)
    friction: float = setting(0.3, "Coulomb friction of the brush", low=0.0, high=1.5)
    stiffness_n_m: float = setting(1500.0, "contact stiffness of brush and board", unit="N/m", low=200.0, high=50000.0)
    damping_n_s_m: float = setting(30.0, "contact damping of brush and board", unit="N s/m", low=0.0, high=500.0)


@dataclass(frozen=True, kw_only=True)
class PaintScene(Checked):
    """The paint job, an input of the painting strategy."""

    color: Color = setting((40, 90, 200), "paint colour", low=0, high=255)
    brush_width_m: float = setting(0.08, "diameter of the round brush", unit="m", low=0.02, high=0.3)
    edge_margin_m: float = setting(0.05, "brush centre to the guiding or stopping edge", unit="m", low=0.01, high=0.5)
    pattern: str = choice("rows", "direction of the strokes", PATTERNS)
    start: str = choice("bottom-right", "corner of the board at which stroke 1 begins", CORNERS)
    rows: int | str = setting(
        2, "number of strokes of either pattern, or as many as the board has place for", low=1, high=20, words=(FILL,)
    )
    stroke_m: float = setting(1.30, "length of every stroke", unit="m", low=0.1, high=20.0)
    overlap_m: float = setting(0.008, "overlap of neighbouring strokes", unit="m", low=0.0, high=0.1)
    speed_m_s: float = setting(0.10, "painting speed", unit="m/s", low=0.01, high=0.5)
    push_n: float = setting(5.0, "push force", unit="N", low=0.5, high=40.0)
    trim_deg: float = setting(0.0, "`limits.trim_deg` that the job permits", unit="deg", low=0.0, high=5.0)

    @property
    def pitch_m(self) -> float:
        """Distance between strokes: brush width minus overlap [m]."""
        return self.brush_width_m - self.overlap_m


@dataclass(frozen=True, kw_only=True)
class StartScene(Checked):
    """Start pose as offsets from facing the beginning of stroke 1."""

    distance_m: float = setting(0.45, "tip to board", unit="m", low=0.15, high=2.0)
    right_m: float = setting(0.0, "offset to the right", unit="m", low=-0.5, high=0.5)
    down_m: float = setting(0.0, "offset downwards", unit="m", low=-0.5, high=0.5)
    yaw_deg: float = setting(0.0, "yaw away from the wall normal, + to the right", unit="deg", low=-20.0, high=20.0)


@dataclass(frozen=True, kw_only=True)
class CameraScene(Checked):
    """The RGB-D camera."""

    width: int = setting(640, "picture width", unit="px", low=160, high=1920)
    height: int = setting(480, "picture height", unit="px", low=120, high=1080)
    vertical_fov_deg: float = setting(42.0, "vertical field of view", unit="deg", low=20.0, high=100.0)
    rate_hz: float = setting(_IMAGE.rate_hz, "frame rate", unit="Hz", low=5.0, high=120.0)
    latency_s: float = setting(_IMAGE.latency_s, "capture to delivery", unit="s", low=0.0, high=0.3)
    depth_noise_relative: float = setting(0.005, "white and correlated depth noise per depth", low=0.0, high=0.05)


@dataclass(frozen=True, kw_only=True)
class ForceTorqueScene(Checked):
    """The force/torque sensor at the arm's base."""

    rate_hz: float = setting(_WRENCH.rate_hz, "sample rate", unit="Hz", low=20.0, high=1000.0)
    sigma_n: float = setting(0.1, "force noise per sample and axis", unit="N", low=0.0, high=10.0)
    sigma_nm: float = setting(0.005, "moment noise per sample and axis", unit="N m", low=0.0, high=1.0)
    bias_n: float = setting(0.05, "size of the force bias of a flight", unit="N", low=0.0, high=20.0)
    latency_s: float = setting(_WRENCH.latency_s, "sampling to delivery", unit="s", low=0.0, high=0.1)


@dataclass(frozen=True, kw_only=True)
class ImuScene(Checked):
    """Gyro, accelerometer and attitude estimate."""

    rate_hz: float = setting(_INERTIAL.rate_hz, "sample rate", unit="Hz", low=50.0, high=1000.0)
    gyro_density: float = setting(3.4e-4, "gyro noise density", unit="rad/s/sqrt(Hz)", low=0.0, high=0.1)
    accel_density: float = setting(4e-3, "accelerometer noise density", unit="m/s^2/sqrt(Hz)", low=0.0, high=1.0)
    attitude_bias_deg: float = setting(0.1, "size of the attitude bias of a flight", unit="deg", low=0.0, high=5.0)
    attitude_noise_deg: float = setting(0.05, "attitude noise per sample", unit="deg", low=0.0, high=5.0)


@dataclass(frozen=True, kw_only=True)
class BarometerScene(Checked):
    """A barometer with a vertical-speed filter; none by default."""

    fitted: bool = setting(False, "the vehicle has one")
    rate_hz: float = setting(_CLIMB.rate_hz, "sample rate", unit="Hz", low=1.0, high=250.0)
    sigma_m_s: float = setting(0.05, "noise of the rate of climb per sample", unit="m/s", low=0.0, high=5.0)
    wander_m_s: float = setting(
        0.05, "slow error by the rotors' wash, standard deviation", unit="m/s", low=0.0, high=5.0
    )
    wander_time_s: float = setting(1.0, "correlation time of the slow error", unit="s", low=0.1, high=100.0)
    latency_s: float = setting(_CLIMB.latency_s, "sampling to delivery", unit="s", low=0.0, high=1.0)


@dataclass(frozen=True, kw_only=True)
class FeaturesScene(Checked):
    """Extra noise on line features, after vision; not part of the reported covariance."""

    sigma_vs: float = setting(0.0, "noise added to rho and theta of each line per frame", low=0.0, high=0.5)


@dataclass(frozen=True, kw_only=True)
class WindScene(Checked):
    """Mean wind (world NED, wall to the north) and Dryden-like gusts."""

    mean_m_s: tuple[float, float, float] = setting((0.0, 0.0, 0.0), "mean wind", unit="m/s", low=-20.0, high=20.0)
    gust_n_rms: float = setting(0.0, "gust force per axis", unit="N", low=0.0, high=20.0)


@dataclass(frozen=True, kw_only=True)
class Scene(Checked):
    """One complete scene; every section and key has a default."""

    board: BoardScene = field(default_factory=BoardScene)
    surface: SurfaceScene = field(default_factory=SurfaceScene)
    wall: WallScene = field(default_factory=WallScene)
    paint: PaintScene = field(default_factory=PaintScene)
    start: StartScene = field(default_factory=StartScene)
    plant: PlantScene = field(default_factory=PlantScene)
    camera: CameraScene = field(default_factory=CameraScene)
    force_torque: ForceTorqueScene = field(default_factory=ForceTorqueScene)
    imu: ImuScene = field(default_factory=ImuScene)
    barometer: BarometerScene = field(default_factory=BarometerScene)
    features: FeaturesScene = field(default_factory=FeaturesScene)
    wind: WindScene = field(default_factory=WindScene)
    errors: WorldErrors = field(default_factory=WorldErrors)

    def __post_init__(self) -> None:
        """A board around a cylinder ends where its normal is `STEEPEST_DEG` off level, or `WIDEST_DEG` aside."""
        super().__post_init__()
        surface, board = self.surface, self.board
        if surface.kind != "cylinder":
            return
        if surface.axis == "horizontal":
            name, size, end, way = "board.height_m", board.height_m, STEEPEST_DEG - abs(surface.lean_deg), "off level"
            angle = STEEPEST_DEG
        else:
            name, size, end, way = "board.width_m", board.width_m, WIDEST_DEG, "aside"
            angle = WIDEST_DEG
        most = 2.0 * surface.radius_m * math.radians(end)
        if size > most:
            reason = f"where the normal of a wall of surface.radius_m = {surface.radius_m:g} m is {angle:g} deg {way}"
            raise out_of_range(name, size, "m", f"allowed is at most {most:.3g} m, {reason}")


def load_scene(file: str | Path) -> Scene:
    """Read a scene file.

    Raises:
        ConfigError: When the file is missing, is no TOML, has an unknown key or a refused value.
    """
    return load_toml(Scene, file)
