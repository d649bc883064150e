"""A figure as one PNG, as a notebook shows it and its rendered copy stores it."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure

from sim.figures.style import styled

#: Resolution [dots per inch]: 880 px for a figure of the page's width.
DOTS_PER_INCH = 119.0


@dataclass(frozen=True)
class Picture:
    """A PNG image with its description."""

    png: bytes
    text: str = ""

    def _mime_(self) -> tuple[str, str]:
        """Representation for marimo."""
        return "image/png", "data:image/png;base64," + base64.b64encode(self.png).decode()

    def _repr_png_(self) -> bytes:
        """Representation for Jupyter."""
        return self.png


def picture(draw: Callable[..., Figure], *arguments: Any) -> Picture:
    """Call a drawing function within the style of all figures and convert its figure to a PNG.

    The first line of the function's docstring becomes the description.
    """
    file = io.BytesIO()
    with styled():
        draw(*arguments).savefig(file, format="png", dpi=DOTS_PER_INCH)
    return Picture(png=file.getvalue(), text=(draw.__doc__ or "").strip().split("\n")[0])
