"""What to look for: a predicted line with what is known of it, and the view in which it is level."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.vision.picture.picture import Picture, pixel_line


@dataclass(frozen=True, kw_only=True)
class LineQuery:
    """A predicted line.

    Attributes:
        rho: Predicted distance, normalised.
        theta: Predicted angle [rad].
        step: Colour step across the line, along the normal, (3,); None for a new line.
        polarity: +1 or -1 if a new line's colours rise or fall along the normal, 0 if unknown.
        span: Normalised range along x (level lines) or y (upright ones) to look at, or None for the whole picture.
        extent: The same kind of range in which it was seen last, or None: most of what is visible there must show it.
        kind: "board", "paint" or "": what the two sides must look like.
        surface_side: Side of the working surface along the normal.
    """

    rho: float
    theta: float
    step: np.ndarray | None = None
    polarity: int = 0
    span: tuple[float, float] | None = None
    extent: tuple[float, float] | None = None
    kind: str = ""
    surface_side: int = 0


@dataclass(frozen=True)
class LineView:
    """A predicted line in the (possibly transposed) view in which it is level: p u + q v + r = 0.

    Attributes:
        query: What is looked for.
        view: The picture, transposed for upright lines.
        upright: Whether the view is transposed.
        sign: +1 if the line's normal points along +v of the view, -1 if along -v.
        coefficients: (p, q, r) in pixels of the view.
        columns: Columns asked for; may reach out of the picture.
        first: First column looked at.
        last: Last column looked at.
    """

    query: LineQuery
    view: Picture
    upright: bool
    sign: int
    coefficients: tuple[float, float, float]
    columns: tuple[float, float]
    first: float
    last: float

    @classmethod
    def of(cls, picture: Picture, query: LineQuery) -> LineView:
        """Place a line in its view."""
        upright = abs(math.cos(query.theta)) > abs(math.sin(query.theta))
        view = picture.transposed if upright else picture
        angle = 0.5 * math.pi - query.theta if upright else query.theta
        sign = 1 if math.sin(angle) > 0.0 else -1
        columns = (0.0, view.width - 1.0)
        if query.span is not None:
            fx, _, cx, _ = view.intrinsics
            columns = (fx * query.span[0] + cx, fx * query.span[1] + cx)
        coefficients = pixel_line(query.rho, angle, view.intrinsics)
        first, last = max(columns[0], 0.0), min(columns[1], view.width - 1.0)
        return cls(
            query=query,
            view=view,
            upright=upright,
            sign=sign,
            coefficients=coefficients,
            columns=columns,
            first=first,
            last=last,
        )

    @property
    def extent(self) -> tuple[float, float]:
        """Columns between which it is known to lie; all of the view if nothing is known."""
        if self.query.extent is None:
            return 0.0, self.view.width - 1.0
        fx, _, cx, _ = self.view.intrinsics
        return fx * self.query.extent[0] + cx, fx * self.query.extent[1] + cx

    @property
    def slope_level(self) -> tuple[float, float]:
        """Slope and level of the line v = slope u + level [px]."""
        p, q, r = self.coefficients
        return -p / q, -r / q

    @property
    def surface(self) -> tuple[float, float, float]:
        """(p, q, r) of the surface over pixels of the view, 1/Z = p u + q v + r; zero if it is unknown."""
        return self.view.surface

    @property
    def side(self) -> int:
        """Side of the surface along +v of the view: +1, -1 or 0 if unknown."""
        return self.sign * self.query.surface_side
