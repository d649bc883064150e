/* The first guess of a surface through a seed: the machine code of hypotheses.py. */

/* Upper median 1/Z of windows of samples, hidden ones and those without a reading left out; 0 where fewer than `least`
   are left. */
void seed_values(const double *inverse, const uint8_t *free_of, const int64_t *windows, long seeds, long width,
                 long least, double *values) {
    double held[WINDOW_MAX];
    for (long seed = 0; seed < seeds; seed++, windows += width) {
        int count = 0;
        for (long k = 0; k < width; k++) {
            double value = inverse[windows[k]];
            if (free_of[windows[k]] && value > 0.0) held[count++] = value;
        }
        values[seed] = count >= least ? upper_median(held, count) : 0.0;
    }
}

/* Samples with a reading that lie near the seed, of the board's colour if enough are; returns how many. */
int near_seed(const double *design, const double *inverse, const uint8_t *labels, const uint8_t *free_of, int size,
              int seed, double reach, int least, int32_t *near) {
    const double *origin = design + 3 * seed;
    int count = 0, boards = 0;
    for (int i = 0; i < size; i++) {
        double x = design[3 * i] - origin[0], y = design[3 * i + 1] - origin[1];
        if (!(inverse[i] > 0.0) || !free_of[i] || !(x * x + y * y < reach * reach)) continue;
        near[count++] = i;
        boards += labels != NULL && labels[i] == BOARD;
    }
    if (labels == NULL || boards < least) return count;
    boards = 0;
    for (int k = 0; k < count; k++)
        if (labels[near[k]] == BOARD) near[boards++] = near[k];
    return boards;
}

/* Planes through the seed, where 1/Z is `value`, and each pair of samples: what agrees with each, and (a, b, c), (3, count). */
void judge_planes(const double *design, const double *inverse, int seed, double value, const int64_t *pairs, int count,
                  const int32_t *judged, int n, double gate, double width, double span, double *restrict planes,
                  double *restrict scores) {
    const double *origin = design + 3 * seed;
    for (int k = 0; k < count; k++) {
        const double *one = design + 3 * pairs[k], *two = design + 3 * pairs[count + k];
        double x1 = one[0] - origin[0], y1 = one[1] - origin[1], x2 = two[0] - origin[0], y2 = two[1] - origin[1];
        double rise1 = inverse[pairs[k]] - value, rise2 = inverse[pairs[count + k]] - value, cross = x1 * y2 - y1 * x2;
        double safe = fabs(cross) > span ? cross : INFINITY;
        double a = (rise1 * y2 - rise2 * y1) / safe, b = (rise2 * x1 - rise1 * x2) / safe;
        planes[k] = a, planes[count + k] = b, planes[2 * count + k] = value - a * origin[0] - b * origin[1];
        scores[k] = 0.0;
    }
    for (int j = 0; j < n; j++) {
        const double *at = design + 3 * judged[j];
        double x = at[0] - origin[0], y = at[1] - origin[1], d = inverse[judged[j]];
        double weight = exp(-(x * x + y * y) / (width * width)), u = at[0], v = at[1], near = gate * d;
        const double *a = planes, *b = planes + count, *c = planes + 2 * count;
        for (int k = 0; k < count; k++) scores[k] += fabs(a[k] * u + b[k] * v + c[k] - d) < near ? weight : 0.0;
    }
}
