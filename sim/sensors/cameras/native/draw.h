/* The drawing of a picture, one row after the other while it is in the cache: `sim/sensors/cameras/drawn.py` calls it. */

#include <math.h>
#include <stdint.h>
#include <string.h>

/* The same bits from plain and from wide registers: whole numbers, and divisions that are rounded as IEEE asks. */
#ifdef __AVX2__
#include <immintrin.h>
#endif

enum { MOST_CUTS = 6, HOLE_PX = 4, HOLE_STEP_PX = 6, SPARE = 8 };

/* A textured plane as one view sees it: homography from picture to texture, and 1/Z = p u + q v + r as measured. */
struct sheet {
    double back[9], plane[3];
};

/* A line of the board's outline: normal . (u, v) + offset > 0 on the board; where its depth holes lie, and how wide. */
struct cut {
    double normal[2], offset, flat, first, end;
    int64_t widths;
};

/* What changes with every picture. */
struct view {
    struct sheet board, wall;
    struct cut cuts[MOST_CUTS];
    int64_t count, color_noise, depth_noise;
};

/* What does not. Arm and brush cover columns [runs[2 k], runs[2 k + 1]) of row v for k in
   [starts[v], starts[v + 1]). The box is (row, row end, column, column end); banks are NULL without noise. */
struct camera {
    int64_t rows, columns, board_rows, board_columns, wall_rows, wall_columns, depth_stride, holes;
    int64_t propeller_box[4];
    const uint8_t *board, *wall, *plain, *arm, *mask, *propellers, *dimmed;
    const float *arm_inverse;
    const int8_t *color_bank;
    const float *depth_bank;
    const int64_t *no_depth, *widths, *starts, *runs;
    uint8_t *scratch;
    double farthest;
};

/* Narrow the columns [low, high) to those where slope * u + value >= 0. */
static inline void narrow(double slope, double value, int64_t *low, int64_t *high)
{
    const double first = (double)*low, end = (double)*high;
    if (slope > 0.0)
        *low = (int64_t)fmin(fmax(ceil(-value / slope), first), end);
    else if (slope < 0.0)
        *high = (int64_t)fmax(fmin(floor(-value / slope) + 1.0, end), first);
    else if (!(value >= 0.0))
        *high = *low;
}
