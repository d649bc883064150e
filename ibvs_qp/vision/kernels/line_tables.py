"""Columns of the tables that the fits of predicted lines read and write, one line a row."""

from __future__ import annotations

#: A predicted line v = SLOPE u + LEVEL in the view in which it is level: the columns looked at [px]; the line; rows of
#: the view and the flat distances of its pixels; columns between which the line is known to lie [px]; whether its
#: colour step along +v is known, and this step; the polarity of a new line along +v; what its sides must look like
#: (`ibvs_qp.vision.lines.admissible`); whether the surface lies behind it; whether it is the border of the surface; and
#: 1/Z = SURFACE_U u + SURFACE_V v + SURFACE of the surface.
(
    BEGIN, SPAN, SLOPE, LEVEL, HEIGHT, ROW_STEP, COLUMN_STEP, SEEN_FROM, SEEN_TO, KNOWN, RED, GREEN, BLUE, POLARITY,
    KIND, BEHIND, BOARD, SURFACE_U, SURFACE_V, SURFACE,
) = range(20)  # fmt: skip

#: A fitted line v = FIT_LEVEL + FIT_SLOPE (u - FIT_CENTER), its variances and residual [px]; the profiles that agree,
#: those of the run that agree or could be seen, and the first and the last of the run; the colour step along +v; and
#: whether there is a line at all.
(
    FIT_LEVEL, FIT_SLOPE, FIT_CENTER, FIT_LEVEL_VARIANCE, FIT_SLOPE_VARIANCE, FIT_RMS, FIT_COUNT, FIT_SEEN, FIT_FIRST,
    FIT_LAST, FIT_RED, FIT_GREEN, FIT_BLUE, FIT_ALIVE,
) = range(14)  # fmt: skip
FIT_COLUMNS = 14
