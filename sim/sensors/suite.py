"""All sensors but the camera, as the vehicle delivers them at a control tick."""

from __future__ import annotations

from typing import Any, Protocol

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import FeatureFrame, RgbdFrame, SensorFrame
from sim.sensors.barometer import Barometer
from sim.sensors.force_torque import ForceTorque
from sim.sensors.imu import Imu
from sim.world.board import BoardGeometry
from sim.world.plant import Plant
from sim.world.scene import Scene


class SensorModel(Protocol):
    """A sensor of the vehicle."""

    reading: dict[str, Any]
    """Fields of a sensor frame that it delivers, with the stamps that are not the tick's."""

    def sample(self, plant: Plant) -> None:
        """Take a sample if one is due, and deliver those whose delay is over."""
        ...


class SensorSuite:
    """All sensors but the camera.

    Attributes:
        models: The sensors.

    Args:
        scene: Rates, noise, biases and delays; the errors of the world.
        vehicle: The vehicle that carries them.
        seed: The same seed gives bit-identical noise; each sensor has its own stream.
    """

    def __init__(self, scene: Scene, vehicle: VehicleParams | None = None, seed: int = 0) -> None:
        self.vehicle = vehicle or VehicleParams()
        self.imu = Imu(scene.imu, BoardGeometry(scene).attitude, scene.errors, seed)
        self.force_torque = ForceTorque(scene.force_torque, scene.errors.force_torque, self.vehicle, seed)
        self.models: list[SensorModel] = [self.imu, self.force_torque]
        if scene.barometer.fitted:
            self.models.append(Barometer(scene.barometer, seed))

    def sample(self, plant: Plant, image: RgbdFrame | None = None, features: FeatureFrame | None = None) -> SensorFrame:
        """Frame of the vehicle at this control tick, with the picture or the features that are due."""
        values: dict[str, Any] = {}
        for model in self.models:
            model.sample(plant)
            values |= model.reading
        return SensorFrame(stamp_ns=plant.time_ns, image=image, features=features, **values)
