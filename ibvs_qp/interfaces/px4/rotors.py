r"""PX4's control allocation: rotors from and to its parameters CA_ROTORn_*, and its setpoints of a wrench.

PX4's control allocation (module control_allocator, `ActuatorEffectivenessRotors`) gives rotor i, with the command
:math:`u_i` within [0, 1], the thrust :math:`C_{T,i} u_i` and the wrench

.. math:: F_i = C_T a_i, \quad M_i = C_T\, p_i \times a_i - C_T K_M a_i

with its position p (PX, PY, PZ, from the centre of mass, FRD), unit axis a (AX, AY, AZ) and moment ratio KM > 0 for a
counter-clockwise rotor: C_T times the column of `allocation.control_effectiveness`.

Its pseudo-inverse (`ControlAllocationPseudoInverse`) divides every column of the mixer
:math:`M = (B\,\mathrm{diag}(C_T))^+` by a scale s of its own, so the setpoint of a wrench w is :math:`s \odot w`:
PX4 then commands :math:`M w`, except for entries that it rounds to zero or limits.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from allocation import RotorGeometry, control_effectiveness
from allocation.geometry import MOST_ROTORS, Rotor, unit
from ibvs_qp.config.errors import ConfigError, shown
from ibvs_qp.config.files import read_bytes

#: Largest file of parameters [bytes]: a complete one of PX4 has 60 kB.
LARGEST_FILE = 1 << 20
#: PX4's defaults of a rotor; its axis points up.
DEFAULTS = {"PX": 0.0, "PY": 0.0, "PZ": 0.0, "AX": 0.0, "AY": 0.0, "AZ": -1.0, "CT": 6.5, "KM": 0.05}
#: Most rotors of PX4's allocation.
MOST_PX4_ROTORS = 12
#: Types of parameters in a file of QGroundControl.
_INT32, _REAL32 = 6, 9
_NAME = r"CA_(?:ROTOR(\d{1,2})_(PX|PY|PZ|AX|AY|AZ|CT|KM)|(ROTOR_COUNT))"
#: A line that sets a parameter: of a script, of QGroundControl (with ids before and a type behind), of ``param show``,
#: or a plain pair as other ground stations write it. Comments, and tests as ``param compare``, set nothing.
_SET = re.compile(
    rf"(?:param\s+set(?:-default)?\s+(?:-\w+\s+)*|\d+\s+\d+\s+|[x*+\s]*){_NAME}"
    rf"(?:\s*\[\d+,\d+\]\s*:\s*|\s*[,:=]\s*|\s+)(\S+)(?:\s+\S+)?"
)
#: Entries of the mixer that PX4 counts for a torque, and for a thrust [-].
_LEAST_TORQUE, _LEAST_THRUST = 1e-3, float(np.finfo(np.float32).eps)


@dataclass(frozen=True, kw_only=True)
class Px4Rotors:
    """Rotors of PX4.

    Attributes:
        geometry: Positions, axes, spins and torque ratios.
        thrust_coefficients: CT of every rotor [N], (n,): its thrust at full command, if it was measured; PX4 needs only
            the ratios.
    """

    geometry: RotorGeometry
    thrust_coefficients: tuple[float, ...]


def read_px4(file: str | Path) -> Px4Rotors:
    """Rotors of a parameter file.

    Raises:
        ConfigError: When the file cannot be read, or as `from_px4`.
    """
    try:
        content = read_bytes(file, LARGEST_FILE)
        return from_px4(_from_bson(content) if _is_bson(content) else content.decode(errors="replace"))
    except ConfigError as error:
        raise ConfigError(f"{file}: {error}") from None


def from_px4(text: str) -> Px4Rotors:
    """Rotors of a text with CA_ROTOR_COUNT and CA_ROTORn_*; missing values have PX4's defaults.

    Args:
        text: Parameters as QGroundControl writes them, the output of ``param show``, pairs of name and value, or a
            script with ``param set`` and ``param set-default``. Of several values of a name the last counts.

    Raises:
        ConfigError: When a value is not a number, or the rotors are no geometry.
    """
    count, values = 0, dict[int, dict[str, float]]()
    lines = (line.split("#")[0] for line in text.splitlines())
    found_lines = (_SET.fullmatch(statement.strip()) for line in lines for statement in line.split(";"))
    for rotor, name, total, number in (match.groups() for match in found_lines if match):
        value = _number(total or f"ROTOR{rotor}_{name}", number)
        if total:
            count = int(value)
        else:
            values.setdefault(int(rotor), {})[name] = value
    if not 1 <= count <= MOST_ROTORS:
        raise ConfigError(f"CA_ROTOR_COUNT = {count} is refused: allowed is [1, {MOST_ROTORS}]")
    found = [DEFAULTS | values.get(index, {}) for index in range(count)]
    for index, entry in enumerate(found):
        if not math.hypot(entry["AX"], entry["AY"], entry["AZ"]) > 0.0:
            raise ConfigError(f"CA_ROTOR{index}_AX, _AY, _AZ are refused: an axis has a length above 0")
        if not entry["CT"] > 0.0:
            raise ConfigError(f"CA_ROTOR{index}_CT = {entry['CT']} is refused: it must be above 0")
    try:
        rotors = tuple(_rotor(index, entry) for index, entry in enumerate(found))
        geometry = RotorGeometry(rotors=rotors, torque_ratio_m=0.0)
    except ValueError as error:
        raise ConfigError(f"CA_ROTORn_*: {error}") from None
    return Px4Rotors(geometry=geometry, thrust_coefficients=tuple(entry["CT"] for entry in found))


def to_px4(geometry: RotorGeometry, thrust_max: Sequence[float]) -> str:
    """Parameters of a geometry as a file of QGroundControl.

    Args:
        geometry: At most `MOST_PX4_ROTORS` rotors.
        thrust_max: Thrust of every rotor at full command [N], (n,): CT.

    Raises:
        ConfigError: When PX4 does not support this number of rotors.
    """
    if geometry.count > MOST_PX4_ROTORS:
        raise ConfigError(f"{geometry.count} rotors are refused: PX4 has at most {MOST_PX4_ROTORS}")
    lines = ["# Vehicle-Id Component-Id Name Value Type", f"1\t1\tCA_ROTOR_COUNT\t{geometry.count}\t{_INT32}"]
    ratios = geometry.spins * geometry.torque_ratios
    rows = zip(geometry.positions, geometry.axes, ratios, thrust_max, strict=True)
    for index, (position, axis, ratio, thrust) in enumerate(rows):
        values = dict(zip(DEFAULTS, (*position, *axis, thrust, ratio), strict=True))
        lines += [f"1\t1\tCA_ROTOR{index}_{name}\t{value:.9g}\t{_REAL32}" for name, value in values.items()]
    return "\n".join(lines) + "\n"


def setpoint_scale(geometry: RotorGeometry, thrust_max_n: float) -> np.ndarray:
    """Setpoint per wrench, for vehicles whose allocation PX4 normalises (multirotors): 1/N and 1/(N m), (6,).

    Args:
        geometry: Rotors, in the order of CA_ROTORn_*.
        thrust_max_n: Thrust of a rotor at full command [N], the same for all.

    Returns:
        Scales of (Fx, Fy, Fz, Mx, My, Mz) in FRD.
    """
    mixer = np.linalg.pinv(thrust_max_n * control_effectiveness(geometry))
    thrust, torque = np.abs(mixer[:, :3]), mixer[:, 3:]
    used = np.maximum((thrust > _LEAST_THRUST).sum(axis=0), 1)
    scale = np.where((thrust > _LEAST_THRUST).any(axis=0), thrust.sum(axis=0) / used, 0.0)
    scale = np.where(scale > 0.0, scale, scale[2])  # an axis without rotors has the scale of z
    rotors = (np.abs(torque[:, :2]) > _LEAST_TORQUE).sum(axis=0)
    level = np.sqrt((torque[:, :2] ** 2).sum(axis=0) / (np.maximum(rotors, 1) / 2.0))
    level = np.where(rotors > 0, level, 1.0).max()
    return np.array((*scale, level, level, torque[:, 2].max()))


def _is_bson(content: bytes) -> bool:
    """Whether a file is one of ``param save``: it begins with its length, and ends with zero."""
    return len(content) > 4 and content[-1] == 0 and int.from_bytes(content[:4], "little") == len(content)


def _from_bson(content: bytes) -> str:
    """Parameters of a BSON document as pairs of name and value.

    Raises:
        ConfigError: When it has an element that PX4 does not write, or is cut.
    """
    kinds = {0x01: "<d", 0x10: "<i", 0x12: "<q"}  # double, int32, int64
    lines, place = list[str](), 4
    try:
        while content[place]:
            kind, end = kinds[content[place]], content.index(0, place + 1)
            (value,) = struct.unpack_from(kind, content, end + 1)
            lines.append(f"{content[place + 1 : end].decode()} {value!r}")
            place = end + 1 + struct.calcsize(kind)
    except (KeyError, IndexError, ValueError, struct.error):
        raise ConfigError(f"its parameters of 'param save' are damaged at byte {place}") from None
    return "\n".join(lines)


def _number(name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ConfigError(f"CA_{name} = {shown(text)} is refused: a finite number is needed")
    return value


def _rotor(index: int, entry: dict[str, float]) -> Rotor:
    x, y, z = unit((entry["AX"], entry["AY"], entry["AZ"])).tolist()
    return Rotor(
        name=f"rotor_{index}",
        spin=1 if entry["KM"] >= 0.0 else -1,
        position_m=(entry["PX"], entry["PY"], entry["PZ"]),
        axis=(x, y, z),
        torque_ratio_m=abs(entry["KM"]),
    )
