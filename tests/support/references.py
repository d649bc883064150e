"""References shared by several test modules."""

from __future__ import annotations

from controller_scenes import line_references

from ibvs_qp.measurement import Reference


def good_reference() -> Reference:
    return Reference(push_force=5.0, contact=True, lines=line_references(2))
