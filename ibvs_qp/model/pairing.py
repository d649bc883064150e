"""Assignment of measured lines to references: by role, then by order; each pair keeps its index."""

from __future__ import annotations

from ibvs_qp.measurement import LineFeature, LineReference


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
    ) -> list[tuple[int, LineFeature, LineReference]]:
        """Index, line and reference of every line with a reference, in the order of the references."""
        found = []
        for reference, (role, order) in zip(references, self._keys, strict=False):
            line = _nth(lines, role, order)
            if line is not None:
                found.append((self._indices[role, order], line, reference))
        return found


def _nth(lines: tuple[LineFeature, ...], role: str, order: int) -> LineFeature | None:
    for line in lines:
        if line.role == role:
            if order == 0:
                return line
            order -= 1
    return None
