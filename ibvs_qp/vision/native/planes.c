/* The surface refitted around its prediction: the machine code of follow_plane.py and of the refits of plane.py. */

enum { BOARD = 1, PAINT = 2, JUDGED = 400 };
static const double FLAT = 1e-6, MAD_TO_SIGMA = 1.4826;

/* The coarse grid and the settings of the fit; see ibvs_qp/vision/native_plane.py. */
typedef struct {
    double rows, columns, block; /* samples, and side of the blocks that tell how far noise holds together */
    double least, gate, sigma; /* samples of a surface, first gate, spread of the residuals [shares of depth] */
    double fine_sigmas, fine_low, fine_high;
    double paint_gates[2]; /* of what looks like paint, share of the board's in either round; 0 for none */
    double adaptive; /* whether the spread is measured in each round, on 400 samples, instead of given */
    double seed; /* flat place of the sample around which the surface is, or -1 for the largest part */
} Grid;

/* The surface: (a, b, c), the inverse of its normal matrix, and what its residuals tell. */
typedef struct {
    double plane[3], inverse[9];
    double count, usable, total, blocks, spread;
} Surface;

static int root_of(const int *parent, int part) {
    while (parent[part] != part) part = parent[part];
    return part;
}

/* Connected parts of the chosen samples, numbered from 1 as they are met; hidden samples connect. `parent` has room for
   half the samples and one more. */
static int connect(const uint8_t *chosen, const uint8_t *free_of, int rows, int columns, int *part, int *parent) {
    int parts = 0;
    for (int at = 0, r = 0; r < rows; r++)
        for (int c = 0; c < columns; c++, at++) {
            int left = c ? part[at - 1] : 0, above = r ? part[at - columns] : 0;
            if (!(chosen[at] || !free_of[at])) part[at] = 0;
            else if (!left && !above) part[at] = ++parts, parent[parts] = parts;
            else if (!left || !above || left == above) part[at] = left ? left : above;
            else { /* the part that was met first has the name */
                int one = root_of(parent, left), two = root_of(parent, above);
                part[at] = one < two ? one : two;
                parent[one < two ? two : one] = part[at];
            }
        }
    for (int k = 1; k <= parts; k++) parent[k] = parent[parent[k]];
    for (int at = 0; at < rows * columns; at++)
        if (part[at]) part[at] = parent[part[at]];
    return parts;
}

/* Keep the connected part of the chosen samples around the seed, or the largest; hidden samples connect. */
static long keep_connected(uint8_t *chosen, const uint8_t *free_of, const Grid *grid, int *votes, int *part) {
    int rows = (int)grid->rows, columns = (int)grid->columns, size = rows * columns, best = 0;
    int parts = connect(chosen, free_of, rows, columns, part, votes);
    memset(votes, 0, (parts + 1) * sizeof(int));
    if (grid->seed >= 0.0) {
        int seed = (int)grid->seed, row = seed / columns, column = seed - row * columns;
        for (int r = row < 2 ? 0 : row - 2; r <= row + 2 && r < rows; r++)
            for (int c = column < 2 ? 0 : column - 2; c <= column + 2 && c < columns; c++)
                if (chosen[r * columns + c]) votes[part[r * columns + c]]++;
    } else
        for (int at = 0; at < size; at++)
            if (chosen[at]) votes[part[at]]++;
    for (int k = 1; k <= parts; k++)
        if (votes[k] > votes[best]) best = k;
    long count = 0;
    for (int at = 0; at < size; at++) count += chosen[at] = best && chosen[at] && part[at] == best;
    return count;
}

/* Inverse of a symmetric 3 x 3 matrix (xx, xy, x, yy, y, count) by cofactors; its determinant. */
static double invert(const double *s, double *inverse) {
    double xx = s[3] * s[5] - s[4] * s[4], xy = s[2] * s[4] - s[1] * s[5], x = s[1] * s[4] - s[2] * s[3];
    double yy = s[0] * s[5] - s[2] * s[2], y = s[1] * s[2] - s[0] * s[4], one = s[0] * s[3] - s[1] * s[1];
    double determinant = s[0] * xx + s[1] * xy + s[2] * x, scale = 1.0 / determinant;
    double cofactors[9] = {xx, xy, x, xy, yy, y, x, y, one};
    for (int i = 0; i < 9; i++) inverse[i] = scale * cofactors[i];
    return determinant;
}

/* How far the samples are from the plane, as shares of depth: their own when they were searched, the plane's when
   followed; 1 where there is no reading. */
static void distances(const Grid *grid, const double *design, const double *inverse, const double *plane,
                      double *relative) {
    int size = (int)(grid->rows * grid->columns);
    for (int i = 0; i < size; i++) {
        double at = design[3 * i] * plane[0] + design[3 * i + 1] * plane[1] + design[3 * i + 2] * plane[2];
        if (!(inverse[i] > 0.0)) relative[i] = 1.0;
        else relative[i] = grid->adaptive != 0.0 ? inverse[i] / fmax(at, 1e-3) - 1.0 : at / inverse[i] - 1.0;
    }
}

/* Samples within the gate: those of the surface's colours, if there are enough of them. */
static long choose(const Grid *grid, const double *relative, const uint8_t *usable, const uint8_t *labels, double gate,
                   double paint_gate, uint8_t *chosen) {
    int size = (int)(grid->rows * grid->columns);
    long count = 0, colored = 0;
    for (int i = 0; i < size; i++) {
        double away = fabs(relative[i]);
        int near = usable[i] && away < gate;
        int right = near && labels != NULL && (labels[i] == BOARD || (labels[i] == PAINT && away < paint_gate * gate));
        chosen[i] = (uint8_t)(near + 2 * right);
        count += near, colored += right;
    }
    int only = labels != NULL && colored >= grid->least;
    for (int i = 0; i < size; i++) chosen[i] = only ? chosen[i] >> 1 : chosen[i] & 1;
    return only ? colored : count;
}

/* Standard deviation of the distances of the chosen samples, from their median. */
static double measured_sigma(const double *relative, const uint8_t *chosen, int size, long count, double *values) {
    long every = count / JUDGED > 1 ? count / JUDGED : 1, index = 0;
    int held = 0;
    for (int i = 0; i < size; i++)
        if (chosen[i] && index++ % every == 0) values[held++] = relative[i];
    double middle = upper_median(values, held);
    for (int i = 0; i < held; i++) values[i] = fabs(values[i] - middle);
    return MAD_TO_SIGMA * upper_median(values, held);
}

/* Least squares over the chosen samples; whether they determine a plane. */
static int solve_plane(const double *design, const double *inverse, const uint8_t *chosen, int size, double *plane,
                       double *inverse_normal) {
    double sums[6] = {0.0}, wanted[3] = {0.0};
    for (int i = 0; i < size; i++) {
        if (!chosen[i]) continue;
        double x = design[3 * i], y = design[3 * i + 1], d = inverse[i];
        sums[0] += x * x, sums[1] += x * y, sums[2] += x, sums[3] += y * y, sums[4] += y, sums[5] += 1.0;
        wanted[0] += x * d, wanted[1] += y * d, wanted[2] += d;
    }
    if (!(invert(sums, inverse_normal) >= FLAT * sums[0] * sums[3] * sums[5]) || sums[5] == 0.0) return 0;
    for (int r = 0; r < 3; r++) {
        const double *row = inverse_normal + 3 * r;
        plane[r] = row[0] * wanted[0] + row[1] * wanted[1] + row[2] * wanted[2];
    }
    return 1;
}

/* Sum of squares of the residuals, and of their sums over blocks. */
static void sum_residuals(const Grid *grid, const double *design, const double *inverse, const uint8_t *chosen,
                          Surface *out, double *residual) {
    int rows = (int)grid->rows, columns = (int)grid->columns, block = (int)grid->block;
    const double *p = out->plane;
    out->total = out->blocks = 0.0;
    for (int i = 0; i < rows * columns; i++) {
        const double *d = design + 3 * i;
        residual[i] = chosen[i] ? inverse[i] - (d[0] * p[0] + d[1] * p[1] + d[2] * p[2]) : 0.0;
        out->total += residual[i] * residual[i];
    }
    for (int top = 0; top + block <= rows; top += block)
        for (int left = 0; left + block <= columns; left += block) {
            double sum = 0.0;
            for (int r = top; r < top + block; r++)
                for (int c = left; c < left + block; c++) sum += residual[r * columns + c];
            out->blocks += sum * sum;
        }
}

/* Two rounds of gated least squares from a start. `inverse` is 0 without a reading, `labels` may be NULL. */
int refit_plane(const Grid *grid, const double *design, const double *inverse, const uint8_t *labels,
                const uint8_t *free_of, const double *start, uint8_t *chosen, Surface *out) {
    enum { GOOD, FEW_ON_SURFACE, FEW_READINGS, ON_A_LINE, NO_MEMORY };
    int size = (int)(grid->rows * grid->columns), problem = GOOD, searched = grid->adaptive != 0.0;
    double *relative = malloc(size * (2 * sizeof(double) + 2 * sizeof(int) + 1) + sizeof(int)), gate = grid->gate;
    if (relative == NULL) return NO_MEMORY;
    double *values = relative + size;
    int *votes = (int *)(values + size), *part = votes + size + 1;
    uint8_t *usable = (uint8_t *)(part + size);
    memcpy(out->plane, start, sizeof out->plane);
    out->usable = 0.0, out->spread = grid->sigma;
    for (int i = 0; i < size; i++) out->usable += usable[i] = free_of[i] && inverse[i] > 0.0;
    if (searched && out->usable < grid->least) problem = FEW_READINGS;
    for (int last = 0; last < 2 && !problem; last++) {
        distances(grid, design, inverse, out->plane, relative);
        if (last && !searched) { /* before the last gate, which would make the spread look smaller */
            int held = 0;
            for (int i = 0; i < size; i++)
                if (chosen[i]) values[held++] = fabs(relative[i]);
            out->spread = MAD_TO_SIGMA * upper_median(values, held);
        }
        long count = choose(grid, relative, usable, labels, gate, grid->paint_gates[last], chosen);
        if (last || searched) count = keep_connected(chosen, free_of, grid, votes, part);
        out->count = count;
        if (count < grid->least) problem = FEW_ON_SURFACE;
        else if (!solve_plane(design, inverse, chosen, size, out->plane, out->inverse)) problem = ON_A_LINE;
        if (!problem && searched) out->spread = measured_sigma(relative, chosen, size, count, values);
        double wanted = grid->fine_sigmas * (searched ? out->spread : grid->sigma);
        gate = fmin(fmax(wanted, grid->fine_low), grid->fine_high);
    }
    if (!problem) sum_residuals(grid, design, inverse, chosen, out, values);
    free(relative);
    return problem;
}
