"""All kernels, and their compilation with the one line about it."""

from __future__ import annotations

import logging

from ibvs_qp.vision.kernels import (  # noqa: F401  importing them fills `KERNELS`
    beside,
    borders,
    brightness,
    colors,
    fit_lines,
    flow,
    flow_points,
    hypotheses,
    labels,
    plane,
    registration,
    samples,
    segments,
)
from ibvs_qp.vision.kernels.compile import KERNELS, stored

log = logging.getLogger(__name__)


def prepare() -> None:
    """Compile every kernel that is not yet, and say so in one line: the first time it takes up to 25 s."""
    if not all(compiled.signatures or stored(compiled) for compiled, _ in KERNELS):
        log.warning("vision is compiled, once: up to 25 s")
    for compiled, signature in KERNELS:
        if not compiled.signatures:
            compiled.compile(signature)
