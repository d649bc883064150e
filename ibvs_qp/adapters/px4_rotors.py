"""Former name of `ibvs_qp.adapters.px4`."""

import warnings

from ibvs_qp.adapters.px4 import Px4Rotors, from_px4, read_px4, to_px4

__all__ = ["Px4Rotors", "from_px4", "read_px4", "to_px4"]

warnings.warn("ibvs_qp.adapters.px4_rotors is ibvs_qp.adapters.px4 now", DeprecationWarning, stacklevel=2)
