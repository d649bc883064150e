"""Pilot: raw sensor frames in, commands out."""

from ibvs_qp.lazy import public_names

__getattr__, __all__ = public_names(__name__, __file__)
