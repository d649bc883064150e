"""Assignment of measured lines to references: by role, then by order; each pair keeps its index."""

from __future__ import annotations

from ibvs_qp.frames import align_line
from ibvs_qp.measurement import VERTICAL, LineFeature, LineReference

#: Lines farther than this from the optical axis are ignored: the interaction matrix degenerates [normalised].
RHO_BOUND = 1.5


class LinePairing:
    """Indices of the references; a pair of role and order keeps its index, and its integral, while it is referenced.

    Args:
        lines: Lines that the program has room for.
    """

    def __init__(self, lines: int) -> None:
        self._count = lines
        self.reset()

    def reset(self) -> None:
        """Forget every pair."""
        self._roles: tuple[str, ...] = ()
        self._indices: dict[tuple[str, int], int] = {}
        self._keys: list[tuple[str, int]] = []

    def assign(self, references: tuple[LineReference, ...]) -> list[int]:
        """Give every reference its index.

        Returns:
            Indices that were freed: their states belong to another reference.
        """
        roles = tuple([reference.role for reference in references[: self._count]])
        if roles == self._roles:
            return []
        self._roles = roles
        self._keys = [(role, roles[:place].count(role)) for place, role in enumerate(roles)]
        freed = [index for key, index in self._indices.items() if key not in self._keys]
        self._indices = {key: index for key, index in self._indices.items() if key in self._keys}
        for key in self._keys:
            if key not in self._indices:
                self._indices[key] = min(set(range(self._count)) - set(self._indices.values()))
        return freed

    def pairs(
        self, lines: tuple[LineFeature, ...], references: tuple[LineReference, ...]
    ) -> list[tuple[int, tuple[float, ...]]]:
        """Index and entries (`ibvs_qp.model.inputs.LINE`) of every line with a reference."""
        found = []
        for reference, (role, order) in zip(references, self._keys, strict=False):
            line = _nth(lines, role, order)
            if line is None or not -RHO_BOUND < line.rho < RHO_BOUND:
                continue
            rho, theta = align_line(line.rho, line.theta, reference.theta)
            place = (rho, theta, reference.rho, reference.theta)
            entries = (1.0, float(role == VERTICAL), *place, line.weight, line.covariance.item(0))
            found.append((self._indices[role, order], entries))
        return found


def _nth(lines: tuple[LineFeature, ...], role: str, order: int) -> LineFeature | None:
    for line in lines:
        if line.role == role:
            if order == 0:
                return line
            order -= 1
    return None
