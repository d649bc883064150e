"""Columns of the tables that the fits of predicted lines read and write, one line a row."""

from __future__ import annotations

#: A predicted line: rho and theta; the ranges along x (level lines) or y (upright ones) to look at and in which it was
#: seen last, all normalised; whether its colour step along the normal is known, and this step; the polarity of a new
#: line along the normal; what its sides must look like (`ibvs_qp.vision.lines.admissible`); the surface's side along
#: the normal; and whether the line is the border of the surface.
(
    RHO, THETA, FROM, TO, SEEN_FROM, SEEN_TO, KNOWN, RED, GREEN, BLUE, POLARITY, KIND, SURFACE_SIDE, BOARD,
) = range(14)  # fmt: skip

#: The camera: focal lengths and principal point [px], and 1/Z = a x + b y + c of the surface, zero if unknown.
FX, FY, CX, CY, PLANE_A, PLANE_B, PLANE_C = range(7)

#: The same line v = SLOPE u + LEVEL [px] in the view in which it is level, rows and columns swapped for an upright one:
#: the flat distances of the view's pixels, its size [px] and its camera; the columns to look at, which may lie outside,
#: and those of them that are in view; the columns in which it was seen last; whether its normal points along +v, as +1
#: or -1; whether the surface lies behind it; its colour step and polarity along +v; and 1/Z of the surface over pixels.
(
    VIEW_UPRIGHT, VIEW_ROW_STEP, VIEW_COLUMN_STEP, VIEW_HEIGHT, VIEW_WIDTH, VIEW_FX, VIEW_FY, VIEW_CX, VIEW_CY,
    VIEW_SLOPE, VIEW_LEVEL, VIEW_FROM, VIEW_TO, VIEW_FIRST, VIEW_LAST, VIEW_SEEN_FROM, VIEW_SEEN_TO, VIEW_SIGN,
    VIEW_BEHIND, VIEW_RED, VIEW_GREEN, VIEW_BLUE, VIEW_POLARITY, VIEW_U, VIEW_V, VIEW_ONE,
) = range(26)  # fmt: skip
VIEW_COLUMNS = 26

#: A fit v = FIT_LEVEL + FIT_SLOPE (u - FIT_CENTER) in a view, its variances and residual [px]; the profiles that agree,
#: those of the run that agree or could be seen, and the first and the last of the run; the colour step along +v; and
#: whether there is a line at all.
(
    FIT_LEVEL, FIT_SLOPE, FIT_CENTER, FIT_LEVEL_VARIANCE, FIT_SLOPE_VARIANCE, FIT_RMS, FIT_COUNT, FIT_SEEN, FIT_FIRST,
    FIT_LAST, FIT_RED, FIT_GREEN, FIT_BLUE, FIT_ALIVE,
) = range(14)  # fmt: skip
FIT_COLUMNS = 14

#: A fitted line: whether there is one; rho and theta, and their covariance; the ends of its segment, normalised; why it
#: ends there, as places in `ENDS`; the share of the run's profiles that agree, and how many; the residual and the
#: length [px]; the colour step along the normal.
(
    ALIVE, LINE_RHO, LINE_THETA, RHO_RHO, RHO_THETA, THETA_RHO, THETA_THETA, X1, Y1, X2, Y2, END_1, END_2, SHARE, COUNT,
    RMS, LENGTH, STEP_RED, STEP_GREEN, STEP_BLUE,
) = range(20)  # fmt: skip
LINE_COLUMNS = 20

#: Why a segment ends: the picture does, the vehicle hides the rest, no more was looked at, or the line really ends.
ENDS = ("picture", "mask", "span", "end")
BY_PICTURE, BY_MASK, BY_SPAN, BY_END = range(4)
