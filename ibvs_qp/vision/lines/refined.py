"""A line fitted to the picture: (rho, theta) with covariance, segment and the reasons of its ends."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.frames import align_line
from ibvs_qp.vision.kernels import line_tables as t

#: Signs of the covariance of (rho, theta) where rho changes its sign.
_REVERSED = np.array([[1.0, -1.0], [-1.0, 1.0]])
_NO_SIDES, _NO_PIXELS = np.zeros((2, 0, 3), np.uint8), np.zeros((0, 2))


@dataclass(frozen=True, kw_only=True)
class RefinedLine:
    """A line fitted to the picture.

    Attributes:
        rho: Distance from the image centre, normalised.
        theta: Angle of the normal, within pi/2 of the prediction's [rad].
        covariance: Of (rho, theta), (2, 2).
        segment: Visible end points, normalised, (2, 2), along growing u (level lines) or v (upright ones).
        ends: Why the segment ends there: "picture", "mask", "span" or "end" (it really ends).
        inlier_share: Share of the visible profiles within the segment that agree.
        rms_px: Residual of the agreeing profiles [px].
        length_px: Length of the segment [px].
        step: Colour behind the line minus colour before it, along the normal, (3,).
        sides: Colours at the agreeing profiles before and behind the line, along the normal, (2, n, 3); empty unless
            asked for.
        pixels: Places of the agreeing profiles, (n, 2) [px]; empty unless asked for.
    """

    rho: float
    theta: float
    covariance: np.ndarray
    segment: np.ndarray
    ends: tuple[str, str]
    inlier_share: float
    rms_px: float
    length_px: float
    step: np.ndarray
    sides: np.ndarray
    pixels: np.ndarray

    @classmethod
    def of(cls, row: np.ndarray, sides: np.ndarray | None, pixels: np.ndarray | None) -> RefinedLine:
        """The line of a row of `ibvs_qp.vision.kernels.line_tables`, with the contents of all profiles if wanted."""
        values, count = row.tolist(), int(row[t.COUNT])
        return cls(
            rho=values[t.LINE_RHO],
            theta=values[t.LINE_THETA],
            covariance=row[t.RHO_RHO : t.THETA_THETA + 1].reshape(2, 2),
            segment=row[t.X1 : t.Y2 + 1].reshape(2, 2),
            ends=(t.ENDS[int(values[t.END_1])], t.ENDS[int(values[t.END_2])]),
            inlier_share=values[t.SHARE],
            rms_px=values[t.RMS],
            length_px=values[t.LENGTH],
            step=row[t.STEP_RED : t.STEP_BLUE + 1],
            sides=_NO_SIDES if sides is None else sides[:, :count],
            pixels=_NO_PIXELS if pixels is None else pixels[:count],
        )

    def aligned(self, theta: float) -> RefinedLine:
        """The same line with its normal within 90 degrees of an angle [rad]."""
        if math.cos(self.theta - theta) >= 0.0:
            return self
        rho, angle = align_line(self.rho, self.theta, theta)
        return dataclasses.replace(
            self,
            rho=rho,
            theta=angle,
            covariance=self.covariance * _REVERSED,
            step=-self.step,
            sides=self.sides[::-1],
        )
