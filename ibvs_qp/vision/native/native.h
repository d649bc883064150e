/* What the machine code of vision shares: the tables that Python fills in and reads, all double, row by row. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* One predicted line v = slope u + level in the view in which it is level; see ibvs_qp/vision/native_lines.py. */
typedef struct {
    double first, span, slope, level; /* columns looked at, and the line [px] */
    double height, row_step, column_step; /* rows of the view, steps of its pixels in memory */
    double seen_from, seen_to; /* columns between which it is known to lie [px] */
    double known, step[3], polarity; /* colour step along +v, or the polarity of a new line */
    double kind, behind, board; /* what its sides must look like, ibvs_qp/vision/admissible.py */
    double surface[3]; /* 1/Z of the surface over pixels of the view */
} Query;

/* What is the same for all lines of a call. */
typedef struct {
    double lines, profiles, reach, side;
    double contrast_min, gate, bridge, min_profiles;
    double depth_known;
} Setting;

/* A fitted line, in its view. */
typedef struct {
    double level, slope, center, level_variance, slope_variance, rms;
    double count, seen, first, last, step[3], alive;
} Fit;

/* A picture and what its colours mean. */
typedef struct {
    const uint8_t *rgb, *mask;
    const float *depth; /* or NULL */
    const uint8_t *labels; /* levels x 32 x 32 x 32, or NULL */
    const uint8_t *levels; /* of light, in cells of the picture; NULL where it is even */
    const uint8_t *fits; /* ibvs_qp/vision/admissible.py */
} Scene;

/* Upper median of n values, which it reorders; infinite without any. */
static double upper_median(double *values, int n) {
    int low = 0, high = n - 1, middle = n / 2;
    if (n == 0) return INFINITY;
    while (low < high) {
        double pivot = values[(low + high) / 2];
        int i = low, j = high;
        while (i <= j) {
            while (values[i] < pivot) i++;
            while (values[j] > pivot) j--;
            if (i <= j) {
                double held = values[i];
                values[i++] = values[j];
                values[j--] = held;
            }
        }
        if (middle <= j) high = j;
        else if (middle >= i) low = i;
        else break;
    }
    return values[middle];
}

/* The labels that hold in the light at a pixel of a picture. */
static inline const uint8_t *labels_at(const uint8_t *labels, const uint8_t *levels, long width, long u, long v) {
    enum { CELL_BITS = 4, TABLE_BITS = 15 };
    long columns = (width + (1 << CELL_BITS) - 1) >> CELL_BITS;
    if (levels == NULL) return labels;
    return labels + ((long)levels[(v >> CELL_BITS) * columns + (u >> CELL_BITS)] << TABLE_BITS);
}

static inline int label_of(const uint8_t *labels, const uint8_t *color) {
    return labels[(color[0] >> 3) << 10 | (color[1] >> 3) << 5 | color[2] >> 3];
}
