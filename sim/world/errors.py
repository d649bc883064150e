"""Errors of a real vehicle and its sensors, beyond the noise of the scene's sensors; all zero is the ideal world.

Every number is a size. The errors of a flight are drawn from its seed: a bias has this length and a random direction, a
calibration error is normal with this standard deviation. Four profiles (`sim/world/profiles`) fill the sections.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import Checked, load_toml, setting

#: Shipped profiles.
PROFILES = Path(__file__).parent / "profiles"


def _size(doc: str, unit: str, high: float) -> Any:
    return setting(0.0, doc, unit=unit, low=0.0, high=high)


@dataclass(frozen=True, kw_only=True)
class AttitudeErrors(Checked):
    """Tilt of the flight controller's attitude estimate."""

    bias_deg: float = _size("constant tilt in a random direction", "deg", 10.0)
    wander_deg: float = _size("slow tilt, standard deviation per axis", "deg", 10.0)
    wander_time_s: float = setting(20.0, "correlation time of the wander", unit="s", low=0.1, high=1e4)
    noise_deg: float = _size("white noise per sample and axis", "deg", 5.0)


@dataclass(frozen=True, kw_only=True)
class GyroErrors(Checked):
    """Angular velocity."""

    density: float = _size("white noise density beyond the scene's", "rad/s/sqrt(Hz)", 0.1)
    bias_rad_s: float = _size("constant bias in a random direction", "rad/s", 0.5)
    instability_rad_s: float = _size("wandering bias, standard deviation per axis", "rad/s", 0.5)
    vibration_rad_s: float = _size("vibration at the rotors' frequencies per axis, rms", "rad/s", 5.0)


@dataclass(frozen=True, kw_only=True)
class AccelerometerErrors(Checked):
    """Specific force."""

    density: float = _size("white noise density beyond the scene's", "m/s^2/sqrt(Hz)", 1.0)
    bias_m_s2: float = _size("constant bias in a random direction", "m/s^2", 2.0)
    instability_m_s2: float = _size("wandering bias, standard deviation per axis", "m/s^2", 2.0)
    vibration_m_s2: float = _size("vibration at the rotors' frequencies per axis, rms", "m/s^2", 20.0)


@dataclass(frozen=True, kw_only=True)
class ForceTorqueErrors(Checked):
    """Force/torque sensor."""

    noise_n: float = _size("white force noise per sample and axis", "N", 10.0)
    noise_nm: float = _size("white moment noise per sample and axis", "N m", 1.0)
    bias_n: float = _size("constant force bias in a random direction", "N", 20.0)
    drift_n_min: float = _size("steady drift of the force in a random direction", "N/min", 20.0)
    gain: float = _size("relative gain error of all channels, standard deviation", "", 0.5)
    cross_talk: float = _size("relative reading of one axis in another, standard deviation", "", 0.5)
    overload_n: float = setting(
        0.0, "force per axis at which the sensor saturates, 0 for never", unit="N", low=0.0, high=1e4
    )
    tool_mass: float = _size("relative error of the nominal tool mass, standard deviation", "", 0.5)


@dataclass(frozen=True, kw_only=True)
class RotorErrors(Checked):
    """Thrust of a commanded rotor."""

    gain: float = setting(0.0, "relative thrust error common to all rotors, constant", low=-0.5, high=0.5)
    spread: float = _size("relative thrust error of every rotor, standard deviation", "", 0.3)
    sag_per_min: float = _size("relative loss of thrust as the battery drains", "1/min", 0.2)
    noise: float = _size("relative thrust noise of every rotor, standard deviation", "", 0.3)
    noise_time_s: float = setting(0.05, "correlation time of the thrust noise", unit="s", low=0.004, high=10.0)


@dataclass(frozen=True, kw_only=True)
class BodyErrors(Checked):
    """True body against the controller's belief."""

    mass: float = setting(0.0, "relative error of the mass, constant", low=-0.3, high=0.3)
    com_m: tuple[float, float, float] = setting(
        (0.0, 0.0, 0.0), "size of the shift of the centre of mass per axis, random sign", unit="m", low=0.0, high=0.1
    )
    inertia: float = setting(0.0, "relative error of the inertia, constant", low=-0.3, high=0.3)
    tip_m: tuple[float, float, float] = setting(
        (0.0, 0.0, 0.0), "true minus nominal position of the tip, FRD", unit="m", low=-0.05, high=0.05
    )


@dataclass(frozen=True, kw_only=True)
class CameraErrors(Checked):
    """Mount, optics and exposure of the camera."""

    mount_m: float = _size("shift of the mount in a random direction", "m", 0.1)
    mount_deg: float = _size("turn of the mount about a random axis", "deg", 5.0)
    focal: float = _size("relative error of the reported focal length, standard deviation", "", 0.2)
    distortion_k1: float = setting(0.0, "radial distortion k1 left after rectification", low=-0.3, high=0.3)
    rolling_shutter_s: float = _size("readout time from the first to the last row", "s", 0.05)
    exposure_s: float = _size("exposure time: blur by the camera's motion, vibration included", "s", 0.05)
    defocus_px: float = _size("blur of the optics beyond the ideal one, standard deviation", "px", 10.0)
    exposure_steps: float = _size("steps of the automatic exposure, relative brightness", "", 0.8)
    dropped: float = _size("probability that a picture is lost", "", 0.9)


@dataclass(frozen=True, kw_only=True)
class DepthErrors(Checked):
    """Depth channel of a stereo camera."""

    noise_relative: float = _size("white noise per depth", "", 0.2)
    disparity_step_px: float = _size("quantisation step of the disparity", "px", 2.0)
    baseline_m: float = setting(0.050, "distance of the two imagers (RealSense D435)", unit="m", low=0.01, high=0.5)
    edge_fattening_px: float = _size("near surfaces grow over far ones at a depth step", "px", 20.0)
    misregistration_px: float = _size("shift of depth against colour in a random direction", "px", 20.0)


@dataclass(frozen=True, kw_only=True)
class TimingErrors(Checked):
    """Delivery and stamps of pictures."""

    jitter_s: float = _size("latency beyond the camera's, exponential mean", "s", 0.1)
    stamp_error_s: float = setting(0.0, "stamp minus true time of capture, constant", unit="s", low=-0.1, high=0.1)
    stamp_jitter_s: float = _size("stamp error per picture, standard deviation", "s", 0.05)


@dataclass(frozen=True, kw_only=True)
class AirErrors(Checked):
    """Wind of a flight, and air that wall and ground shape; each is drawn from the seed."""

    wind_m_s: float = _size("mean wind up to this, in a random level direction", "m/s", 20.0)
    shear: float = _size("exponent of the mean wind over height", "", 1.0)
    gust_n: tuple[float, float] = setting(
        (0.0, 0.0), "least and largest rms of the gust force per axis", unit="N", low=0.0, high=20.0
    )
    front_m_s: float = _size("change of the mean wind as a front passes, in a random level direction", "m/s", 20.0)
    front_rise_s: float = setting(0.5, "time of that change", unit="s", low=0.0, high=60.0)
    front_every_s: float = setting(15.0, "mean time between fronts", unit="s", low=1.0, high=1e4)
    wall_thrust: float = _size("relative change of a rotor's thrust at 0.3 radii from the wall, up to this", "", 0.5)
    ground_thrust: float = _size("relative gain of a rotor's thrust at 0.3 radii above the ground, up to this", "", 0.5)
    recirculation: float = _size("relative thrust noise at 0.3 radii from the wall, standard deviation", "", 0.5)


@dataclass(frozen=True, kw_only=True)
class ArmErrors(Checked):
    """A flexible arm: tool and brush swing about the force/torque sensor."""

    mode_hz: float = _size("frequency of the swing of a free tip at a clamped vehicle, 0 for a rigid arm", "Hz", 200.0)
    damping: float = setting(0.02, "its damping ratio", low=0.0, high=1.0)


@dataclass(frozen=True, kw_only=True)
class BrushErrors(Checked):
    """Bristles and paint instead of a spring."""

    progression_per_mm: float = _size("relative growth of the stiffness with the penetration", "1/mm", 5.0)
    hysteresis: float = _size("relative stiffness more when pressed, and less when released", "", 0.9)
    static_friction: float = _size("relative friction more while the brush sticks", "", 3.0)
    drag_n_s_m: float = _size("viscous drag of wet paint along the wall", "N s/m", 200.0)
    drying_s: float = setting(20.0, "time on the wall in which the drag falls by 1/e", unit="s", low=0.1, high=1e4)


@dataclass(frozen=True, kw_only=True)
class ReliefErrors(Checked):
    """Rivets, seams and steps of the board, drawn from the seed."""

    rivets_per_m2: float = _size("rivets", "1/m^2", 200.0)
    seams_per_m: float = _size("upright seams per length", "1/m", 20.0)
    height_m: tuple[float, float] = setting((0.001, 0.004), "least and largest height", unit="m", low=0.0, high=0.02)
    step_m: float = _size("height of an upright step", "m", 0.02)


#: Effects of pictures outside that come together.
_TOGETHER = (
    ("beams", "beam_shade"),
    ("own_shade",),
    ("glare",),
    ("overexposure",),
    ("low_light",),
    ("rust_per_m",),
    ("stains_per_m2",),
    ("broken_m",),
    ("wet_gloss", "wet_holes"),
    ("drops", "dust"),
)


@dataclass(frozen=True, kw_only=True)
class OutdoorErrors(Checked):
    """Pictures outside, drawn from the seed; shade, glare, exposure, low light and gloss: half their size to all."""

    chance: float = setting(1.0, "probability that a flight has an effect, each by itself", low=0.0, high=1.0)
    beams: int = setting(0, "shadows of beams across the board", low=0, high=20)
    beam_shade: float = _size("light that the shadow of a beam takes", "", 0.9)
    own_shade: float = _size("light that the vehicle's own shadow takes, propellers less", "", 0.9)
    glare: float = _size("the sun mirrored by the wall, fraction of white", "", 3.0)
    overexposure: float = _size("exposure beyond the nominal one: bright colours are cut off", "", 3.0)
    low_light: float = _size("light that is missing, with the noise of its amplification", "", 0.95)
    rust_per_m: float = _size("streaks of rust per width of the board", "1/m", 100.0)
    stains_per_m2: float = _size("blots of the paint's colour", "1/m^2", 200.0)
    broken_m: float = _size("length over which dirt of the wall's colour covers one edge", "m", 5.0)
    wet_gloss: float = _size("sky and sun mirrored by wet paint, fraction of white", "", 1.0)
    wet_holes: float = _size("fraction of wet paint without a depth reading", "", 1.0)
    drops: int = setting(0, "rain drops on the lens", low=0, high=200)
    dust: int = setting(0, "specks of dust on the lens", low=0, high=500)

    def drawn(self, rng: np.random.Generator) -> OutdoorErrors:
        """The effects of one flight, of which each is present by chance."""
        absent = {name: 0 for group in _TOGETHER if rng.random() >= self.chance for name in group}
        return dataclasses.replace(self, chance=1.0, **absent)


@dataclass(frozen=True, kw_only=True)
class WorldErrors:
    """All errors of a world."""

    attitude: AttitudeErrors = field(default_factory=AttitudeErrors)
    gyro: GyroErrors = field(default_factory=GyroErrors)
    accelerometer: AccelerometerErrors = field(default_factory=AccelerometerErrors)
    force_torque: ForceTorqueErrors = field(default_factory=ForceTorqueErrors)
    rotors: RotorErrors = field(default_factory=RotorErrors)
    body: BodyErrors = field(default_factory=BodyErrors)
    camera: CameraErrors = field(default_factory=CameraErrors)
    depth: DepthErrors = field(default_factory=DepthErrors)
    timing: TimingErrors = field(default_factory=TimingErrors)
    air: AirErrors = field(default_factory=AirErrors)
    arm: ArmErrors = field(default_factory=ArmErrors)
    brush: BrushErrors = field(default_factory=BrushErrors)
    relief: ReliefErrors = field(default_factory=ReliefErrors)
    outdoor: OutdoorErrors = field(default_factory=OutdoorErrors)


def world_names() -> list[str]:
    """Names of the shipped profiles."""
    return sorted(file.stem for file in PROFILES.glob("*.toml"))


def world_errors(name: str) -> WorldErrors:
    """A shipped profile by name, or one from a TOML file.

    Raises:
        ConfigError: When there is no such profile or file, or it is refused.
    """
    file = PROFILES / f"{name}.toml"
    if file.exists():
        return load_toml(WorldErrors, file)
    if Path(name).suffix == ".toml":
        return load_toml(WorldErrors, name)
    raise ConfigError(f"world {name!r} is refused; known worlds: {', '.join(world_names())}, or a TOML file")


def single_errors(errors: WorldErrors) -> dict[str, WorldErrors]:
    """Every error of a world alone, by its dotted name ("accelerometer.vibration_m_s2"); the others are zero."""
    found: dict[str, WorldErrors] = {}
    for part in dataclasses.fields(errors):
        section, ideal = getattr(errors, part.name), getattr(WorldErrors(), part.name)
        for entry in dataclasses.fields(section):
            value = getattr(section, entry.name)
            if value != getattr(ideal, entry.name):
                alone = dataclasses.replace(ideal, **{entry.name: value})
                found[f"{part.name}.{entry.name}"] = dataclasses.replace(WorldErrors(), **{part.name: alone})
    return found
