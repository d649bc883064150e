"""RGB-D pictures to plane, lines and velocity.

The names load on first use: a controller that is fed with lines needs the interaction matrix, but no OpenCV.
"""

from ibvs_qp.lazy import public_names

__getattr__, __all__ = public_names(__name__, __file__)
