"""A figure as one PNG: what a cell shows, and what its copy for reading keeps."""

from __future__ import annotations

import base64
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import cv2
import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sim.figures.style import styled

#: Resolution of a picture [dots per inch]: 880 px for a page-wide figure, sharp in a notebook and small in a file.
DOTS_PER_INCH = 119.0
#: Lines and even grounds need no prediction of their pixels: the smallest file, and in half the time.
PNG = (cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_NONE, cv2.IMWRITE_PNG_COMPRESSION, 6)


@dataclass(frozen=True)
class Picture:
    """A PNG with its description, for whoever cannot see it; a notebook shows it as an image."""

    png: bytes
    text: str = ""

    def _mime_(self) -> tuple[str, str]:
        """What marimo shows."""
        return "image/png", "data:image/png;base64," + base64.b64encode(self.png).decode()

    def _repr_png_(self) -> bytes:
        """What Jupyter shows."""
        return self.png


def picture(draw: Callable[..., Figure], *arguments: Any, dpi: float = DOTS_PER_INCH, **options: Any) -> Picture:
    """Draw a figure in the style of all figures.

    Args:
        draw: Makes the figure.
        arguments: Its arguments.
        dpi: Resolution [dots per inch].
        options: Its keyword arguments.

    Returns:
        The picture; its text is the first line of the drawing function's documentation.
    """
    with styled(), matplotlib.rc_context({"savefig.dpi": dpi, "figure.dpi": dpi}):
        figure = draw(*arguments, **options)
        # `Figure.savefig` would work out every text and line twice, once for nothing but the layout.
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        coloured = np.asarray(canvas.buffer_rgba())[..., :3]  # the figure has a ground: nothing shines through
    done, png = cv2.imencode(".png", coloured[..., ::-1], PNG)
    assert done, "a PNG of bytes in memory is always written"
    return Picture(png=png.tobytes(), text=(draw.__doc__ or "").strip().split("\n")[0])
