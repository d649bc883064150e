"""Public names of `ibvs_qp.analysis.contact`: settings need it only where a file is read."""

from ibvs_qp.lazy import public_names

__getattr__, __all__ = public_names(__name__, __file__)
