"""Values in ROS's axes: against rotation matrices, there and back, and in closed loop."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from references import good_reference
from scipy.spatial.transform import Rotation
from small_vehicle import SmallVehicle

from ibvs_qp import FeatureFrame, HybridController, SensorFrame
from ibvs_qp.axes import swap_attitude, swap_axes, swap_covariance, swap_vector

NED_ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
FLU_FRD = np.diag([1.0, -1.0, -1.0])
entries = st.floats(-1.0, 1.0)


@settings(deadline=None)
@given(st.lists(entries, min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_an_attitude_is_that_of_the_rotation_matrices(quaternion: list[float]) -> None:
    unit = np.array(quaternion) / np.linalg.norm(quaternion)
    matrix = Rotation.from_quat(unit, scalar_first=True).as_matrix()
    swapped = swap_attitude(unit)
    np.testing.assert_allclose(
        Rotation.from_quat(swapped, scalar_first=True).as_matrix(), NED_ENU @ matrix @ FLU_FRD, atol=1e-12
    )
    back = swap_attitude(swapped)
    np.testing.assert_allclose(back * np.sign(back @ unit), unit, atol=1e-12)


@settings(deadline=None)
@given(st.lists(entries, min_size=6, max_size=6))
def test_vectors_and_covariances_follow_the_body_axes(values: list[float]) -> None:
    force, moment = np.array(values[:3]), np.array(values[3:])
    np.testing.assert_allclose(swap_vector(values), [*(FLU_FRD @ force), *(FLU_FRD @ moment)])
    covariance = np.outer(force, force) + np.eye(3)
    np.testing.assert_allclose(swap_covariance(covariance), FLU_FRD @ covariance @ FLU_FRD.T)


def test_a_vehicle_in_ros_axes_flies_the_same() -> None:
    controller, other = HybridController(), HybridController()
    vehicle = SmallVehicle(controller.config)
    for _ in range(50):
        seen = vehicle.measure(velocity=np.array([0.01, 0.02, 0.03]), velocity_covariance=np.diag([1e-4, 2e-4, 3e-4]))
        there = swap_axes(seen)
        assert there.specific_force is not None and seen.specific_force is not None
        assert there.specific_force[2] == -seen.specific_force[2] > 0.0  # at rest: up in FLU
        command = controller.step(seen, good_reference())
        back = other.step(swap_axes(there), good_reference())
        np.testing.assert_allclose(back.thrusts, command.thrusts, atol=1e-9)
        vehicle.fly(command.thrusts)


def test_every_type_goes_there_and_back() -> None:
    vehicle = SmallVehicle(HybridController().config)
    seen = vehicle.measure()
    features = FeatureFrame(
        lines=seen.lines, plane=seen.plane, stamp_ns=1, velocity=np.ones(3), velocity_covariance=np.eye(3)
    )
    frame = SensorFrame(
        stamp_ns=1,
        attitude=seen.attitude,
        angular_velocity=np.arange(3.0),
        specific_force=np.arange(3.0),
        wrench=np.arange(6.0),
        wrench_stamp_ns=1,
        features=features,
    )
    reference = dataclasses.replace(good_reference(), tilt=np.array([0.1, 0.2]))
    command = HybridController().step(seen, reference)
    for value in (seen, frame, features, reference, command):
        assert same(swap_axes(swap_axes(value)), value)
    assert swap_axes(frame).features.velocity.tolist() == [1.0, -1.0, -1.0]
    assert swap_axes(reference).tilt.tolist() == [0.1, -0.2]
    with pytest.raises(TypeError, match="float has no axes"):
        swap_axes(1.0)


def same(first: object, second: object) -> bool:
    for field in dataclasses.fields(first):  # type: ignore[arg-type]
        a, b = getattr(first, field.name), getattr(second, field.name)
        if field.name == "attitude":
            a = a * np.sign(np.dot(a, b))
        if dataclasses.is_dataclass(a):
            assert same(a, b), field.name
        elif isinstance(a, np.ndarray):
            np.testing.assert_allclose(a, b, atol=1e-12)
        else:
            assert a == b or a != a, field.name
    return True
