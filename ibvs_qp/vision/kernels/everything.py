"""Imports every module of kernels, so that `prepare` finds them."""

from ibvs_qp.vision.kernels import labels, registration

__all__ = ["labels", "registration"]
