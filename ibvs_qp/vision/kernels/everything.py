"""Imports every module of kernels, so that `prepare` finds them."""

from ibvs_qp.vision.kernels import labels

__all__ = ["labels"]
