"""All sensors but the camera, as the vehicle delivers them at a control tick."""

from __future__ import annotations

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import FeatureFrame, RgbdFrame, SensorFrame
from sim.sensors.force_torque import ForceTorque
from sim.sensors.imu import Imu
from sim.world.plant import Plant
from sim.world.scene import Scene


class SensorSuite:
    """All sensors but the camera.

    Args:
        scene: Rates, noise, biases and delays; the errors of the world.
        vehicle: The vehicle that carries them.
        seed: The same seed gives bit-identical noise; each sensor has its own stream.
    """

    def __init__(self, scene: Scene, vehicle: VehicleParams | None = None, seed: int = 0) -> None:
        self.vehicle = vehicle or VehicleParams()
        self.imu = Imu(scene.imu, scene.errors, seed)
        self.force_torque = ForceTorque(scene.force_torque, scene.errors.force_torque, self.vehicle, seed)

    def sample(self, plant: Plant, image: RgbdFrame | None = None, features: FeatureFrame | None = None) -> SensorFrame:
        """Sensor frame of this control tick, with the picture or the features that are due."""
        imu, force_torque = self.imu, self.force_torque
        imu.sample(plant)
        force_torque.sample(plant)
        return SensorFrame(
            stamp_ns=plant.time_ns,
            attitude=imu.attitude,
            angular_velocity=imu.angular_velocity,
            specific_force=imu.specific_force,
            wrench=force_torque.wrench,
            wrench_stamp_ns=force_torque.stamp_ns,
            image=image,
            features=features,
        )
