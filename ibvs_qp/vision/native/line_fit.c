/* Robust straight lines through one point per profile: the machine code of consensus.py and fit_lines.py. */

static const double TUKEY = 4.685, SCALE_MIN = 0.02, MAD = 1.4826, CORRELATION_MAX = 0.8, AGREEING = 0.8;
static const float APART = 4.0f;
enum { STARTS = 20 };

static double middle_of(const double *values, const uint8_t *used, int n, double *scratch) {
    int count = 0;
    for (int k = 0; k < n; k++)
        if (used[k]) scratch[count++] = values[k];
    return upper_median(scratch, count);
}

/* Distances from the prediction moved to the middle of the points, and whether most agree with it. */
static int shifted(const double *row, const double *predicted, const uint8_t *good, int n, double gate,
                   double *distance, double *scratch) {
    int count = 0, near = 0;
    for (int k = 0; k < n; k++) distance[k] = row[k] - predicted[k];
    double middle = middle_of(distance, good, n, scratch);
    for (int k = 0; k < n; k++) {
        distance[k] -= middle;
        count += good[k];
        near += good[k] && fabs(distance[k]) < gate;
    }
    return near >= fmax(AGREEING * count, 1.0);
}

/* Distances from the line that most points agree with, among lines through fixed pairs; whether a pair spans one. */
static int consensus(const double *u, const double *row, const uint8_t *good, int n, float gate, double *distance,
                     int *held) {
    int count = 0, spans = 0;
    float most = -1.0f, best_slope = 0.0f, best_level = 0.0f;
    for (int k = 0; k < n; k++)
        if (good[k]) held[count++] = k;
    if (count == 0) return 0;
    for (int pair = 0; pair < 2 * STARTS; pair++) {
        int one = (int)((pair % STARTS) * (1.0 / (STARTS - 1)) * (count - 1));
        int two = (one + count / (pair < STARTS ? 2 : 3)) % count;
        float u1 = (float)u[held[one]], v1 = (float)row[held[one]], run = (float)u[held[two]] - u1, score = 0.0f;
        if (!(fabsf(run) > APART)) continue;
        float slope = ((float)row[held[two]] - v1) / run, level = v1 - slope * u1;
        for (int k = 0; k < count; k++) {
            float d = level + slope * (float)u[held[k]] - (float)row[held[k]];
            score += fmaxf(d * d * (-1.0f / (gate * gate)) + 1.0f, 0.0f);
        }
        if (!spans || score > most) most = score, best_slope = slope, best_level = level;
        spans = 1;
    }
    for (int k = 0; k < n; k++) distance[k] = best_level + best_slope * (float)u[k] - (float)row[k];
    return spans;
}

/* First and last point of the run with most support; up to `bridge` visible misses in a row are bridged. */
static void longest_run(const uint8_t *support, const uint8_t *visible, int n, int bridge, int *first, int *last) {
    int start = -1, before = -1, held = 0, most = 0, missed = 0;
    *first = *last = 0;
    for (int k = 0; k < n; k++) {
        missed += visible[k] && !support[k];
        if (!support[k]) continue;
        if (before < 0 || missed > bridge) start = k, held = 0;
        held++, missed = 0, before = k;
        if (held > most) most = held, *first = start, *last = k;
    }
}

/* Tukey-weighted least squares, two rounds, with the variances that the residuals tell. */
static void tukey_line(const double *u, const double *v, const uint8_t *used, int n, Fit *fit, double *residual,
                       double *weight) {
    double middle = 0.5 * (u[0] + u[n - 1]), half = fmax(0.5 * (u[n - 1] - u[0]), 1.0), unit = 0.0;
    double slope = 0.0, level = 0.0, center = 0.0, spread = 1.0;
    for (int k = 0; k < n; k++) weight[k] = used[k];
    for (int round = 0; round < 2; round++) {
        double total = 0.0, along = 0.0, square = 0.0, rows = 0.0, product = 0.0;
        for (int k = 0; k < n; k++) {
            double a = (u[k] - middle) / half;
            total += weight[k], along += weight[k] * a, square += weight[k] * (a * a);
            rows += weight[k] * v[k], product += weight[k] * (a * v[k]);
        }
        total = fmax(total, 1e-9);
        center = along / total;
        spread = fmax(square - along * center, 1e-9);
        slope = (product - rows * center) / spread;
        level = rows / total;
        for (int k = 0; k < n; k++) residual[k] = v[k] - (level - slope * center) - slope * ((u[k] - middle) / half);
        if (round == 0) {
            int count = 0;
            for (int k = 0; k < n; k++)
                if (used[k]) weight[count++] = fabs(residual[k]);
            double scale = count ? upper_median(weight, count) : 0.0;
            unit = 1.0 / (TUKEY * fmax(MAD * scale, SCALE_MIN));
        }
        for (int k = 0; k < n; k++) {
            double share = residual[k] * unit, left = fmax(1.0 - share * share, 0.0);
            weight[k] = left * left * used[k];
        }
    }
    double total = 0.0, square = 0.0, neighbours = 0.0, residuals = 0.0, before = 0.0;
    for (int k = 0; k < n; k++) {
        double r = residual[k] * used[k], weighted = weight[k] * r;
        total += weight[k], square += weighted * r, residuals += r * r;
        neighbours += before * weighted;
        before = weighted;
    }
    total = fmax(total, 1.0);
    double variance = square / fmax(total - 2.0, 1.0) + SCALE_MIN * SCALE_MIN / 12.0;
    double correlation = fmin(fmax(neighbours / fmax(square, 1e-12), 0.0), CORRELATION_MAX);
    variance *= (1.0 + correlation) / (1.0 - correlation);
    fit->level = level, fit->slope = slope / half, fit->center = middle + half * center;
    fit->level_variance = variance / total, fit->slope_variance = variance / (spread * half * half);
    fit->rms = sqrt(residuals / fmax(fit->count, 1.0));
}
