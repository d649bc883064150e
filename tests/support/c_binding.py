"""The C library from Python: for comparisons and flights with exactly what runs on the target."""

from __future__ import annotations

import ctypes
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from ibvs_qp.config import ControllerConfig, Gains
from ibvs_qp.measurement import VERTICAL, Measurement, Reference
from ibvs_qp.validation.measurement import LINES_PER_SLOT


class Structures:
    """Types of ``ibvs_qp.h`` for one configuration and precision.

    Attributes:
        real: Type of a number.
        measurement, reference, line_reference, command: The structures.
    """

    def __init__(self, config: ControllerConfig, rows: int, single: bool) -> None:
        self.real = real = ctypes.c_float if single else ctypes.c_double
        rotors = config.vehicle.geometry.count
        flag, stamp, count = ctypes.c_bool, ctypes.c_int64, ctypes.c_uint32
        numbers = dict.fromkeys(("rho", "theta", "weight", "variance"), real)
        turned = {"covariance": real, "theta_variance": real}
        line = structure("ibvs_line", **numbers, stamp_ns=stamp, role=count, **turned)
        self.line_reference = target = structure("ibvs_line_reference", rho=real, theta=real, role=count)
        self.gains = structure("ibvs_gains", **{field.name: real for field in fields(Gains)})
        self.measurement = structure(
            "ibvs_measurement",
            stamp_ns=stamp,
            attitude=real * 4,
            angular_velocity=real * 3,
            has_specific_force=flag,
            specific_force=real * 3,
            contact_wrench=real * 6,
            wrench_stamp_ns=stamp,
            has_velocity=flag,
            velocity=real * 3,
            has_velocity_stamp=flag,
            velocity_stamp_ns=stamp,
            has_acceleration_bias=flag,
            acceleration_bias=real * 3,
            has_plane=flag,
            plane=real * 4,
            plane_stamp_ns=stamp,
            has_thrust_min=flag,
            has_thrust_max=flag,
            thrust_min=real * rotors,
            thrust_max=real * rotors,
            line_count=count,
            lines=line * (LINES_PER_SLOT * config.line_slots),
        )
        self.reference = structure(
            "ibvs_reference",
            push_force=real,
            standoff=real,
            velocity=real * 2,
            travel=real * 2,
            tilt=real * 2,
            trim=real * 2,
            contact=flag,
            line_count=count,
            lines=target * config.line_slots,
        )
        self.command = structure(
            "ibvs_command_result",
            stamp_ns=stamp,
            thrusts=real * rotors,
            wrench=real * 6,
            unallocated_wrench=real * 6,
            multipliers=real * rows,
            outcome=count,
            mode=count,
            rejected=count,
            iterations=ctypes.c_int32,
            wall_known=flag,
            distance=real,
            push=real,
            reach=real,
        )

    def packed(self, measurement: Measurement) -> Any:
        """A measurement with sound types as the library's structure."""
        own = self.measurement()
        for name in ("attitude", "angular_velocity", "contact_wrench"):
            getattr(own, name)[:] = np.asarray(getattr(measurement, name), float).tolist()
        for name in ("specific_force", "velocity", "acceleration_bias", "plane", "thrust_min", "thrust_max"):
            value = getattr(measurement, name)
            setattr(own, f"has_{name}", value is not None)
            if value is not None:
                getattr(own, name)[:] = np.asarray(value, float).tolist()
        own.stamp_ns, own.wrench_stamp_ns = measurement.stamp_ns, measurement.wrench_stamp_ns
        own.plane_stamp_ns = measurement.plane_stamp_ns
        own.has_velocity_stamp = measurement.velocity_stamp_ns is not None
        own.velocity_stamp_ns = measurement.velocity_stamp_ns or 0
        lines = measurement.lines[: len(own.lines)]
        own.line_count = len(lines)
        for place, line in zip(own.lines, lines, strict=False):
            place.rho, place.theta, place.weight, place.variance = (
                line.rho,
                line.theta,
                line.weight,
                line.covariance[0, 0],
            )
            place.covariance, place.theta_variance = line.covariance[0, 1], line.covariance[1, 1]
            place.stamp_ns, place.role = line.stamp_ns, int(line.role == VERTICAL)
        return own

    def packed_reference(self, reference: Reference) -> Any:
        """A reference with sound types as the library's structure."""
        own = self.reference()
        own.push_force, own.standoff, own.contact = reference.push_force, reference.standoff, reference.contact
        for name in ("velocity", "travel", "tilt", "trim"):
            getattr(own, name)[:] = np.asarray(getattr(reference, name), float).tolist()
        lines = reference.lines[: len(own.lines)]
        own.line_count = len(lines)
        for place, line in zip(own.lines, lines, strict=False):
            place.rho, place.theta, place.role = line.rho, line.theta, int(line.role == VERTICAL)
        return own


def structure(name: str, **members: Any) -> Any:
    """Type of a structure with these members."""
    return type(name, (ctypes.Structure,), {"_fields_": list(members.items())})


class CController:
    """One instance of a built library.

    Args:
        library: ``libibvs_qp.so``.
        config: The configuration it was written for.
        rows: Rows of the program, of its limits.
        single: Whether its numbers are floats.
    """

    def __init__(self, library: Path, config: ControllerConfig, rows: int, single: bool = False) -> None:
        self._library = ctypes.CDLL(str(library))
        self._types = Structures(config, rows, single)
        self._memory = ctypes.create_string_buffer(self._library.ibvs_size() + 16)
        self._instance = ctypes.c_void_p(-(-ctypes.addressof(self._memory) // 16) * 16)
        self.command = self._types.command()
        self._library.ibvs_init(self._instance)

    @property
    def gains(self) -> Any:
        """The gains, to be changed between steps: a structure in the instance."""
        return ctypes.cast(self._instance, ctypes.POINTER(self._types.gains)).contents

    def reset(self) -> None:
        """As after construction."""
        self._library.ibvs_reset(self._instance)

    def step(self, measurement: Measurement, reference: Reference) -> Any:
        """One tick; the command is overwritten by the next one."""
        given, targets = self._types.packed(measurement), self._types.packed_reference(reference)
        self._library.ibvs_step(self._instance, *map(ctypes.byref, (given, targets, self.command)))
        return self.command
