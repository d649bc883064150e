"""Axes of the wall in the body frame."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ibvs_qp.model.inputs import Body, Contact

#: Least sine between wall normal and gravity; it keeps the axes of a floor finite.
LEAST_CROSS = 1e-6


@dataclass(frozen=True, kw_only=True)
class WallAxes:
    """Unit vectors in B: normal into the wall, right and down in its plane."""

    normal: ca.SX
    right: ca.SX
    down: ca.SX

    def in_body(self, right: ca.SX, down: ca.SX) -> ca.SX:
        """A vector of the wall plane in B, (3,)."""
        return right * self.right + down * self.down


def wall_axes(body: Body, contact: Contact) -> WallAxes:
    """Axes of the wall: right is level and in the wall, down completes it."""
    across = ca.cross(body.down, contact.normal)
    right = across / ca.fmax(ca.norm_2(across), LEAST_CROSS)
    return WallAxes(normal=contact.normal, right=right, down=ca.cross(contact.normal, right))
