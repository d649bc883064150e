"""Inner loops of vision, compiled by numba: what OpenCV and NumPy do not offer, or only by many calls on small arrays.

Every kernel is one Python function with the types of its arguments. `prepare` compiles all of them, once: numba keeps
the machine code beside the source, or in the user's cache folder where the package cannot be written.
"""

from ibvs_qp.vision.kernels.compile import inner, kernel
from ibvs_qp.vision.kernels.everything import prepare

__all__ = ["inner", "kernel", "prepare"]
