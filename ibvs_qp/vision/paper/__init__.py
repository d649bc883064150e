"""The paper's vision pipeline, the named baseline of the own perception."""

from ibvs_qp.lazy import public_names

__getattr__, __all__ = public_names(__name__, __file__)
