/* From followed points to a velocity: the machine code of flow_solve.py. */

enum { ROUNDS = 4, WIDTH = 7 };

/* Settings of the solution; see ibvs_qp/vision/native_flow.py. */
typedef struct {
    double n, scale, interval, prior, gate_sigmas; /* points, root's factor [px s], [s], [s2/m2], sigmas */
} Solve;

/* Velocity (3), weighted squares, weights, agreeing points, and the sums of products (7 x 7) of the last round but its
   weights; 0 if the points determine none. `rows` holds 14 numbers a point. */
int solve_flow(const Solve *s, const double *still, const double *end, const double *inverse, const double *root,
               double *rows, double *weight, double *size, double *values, double *out, double *sums) {
    int n = (int)s->n;
    for (int i = 0; i < n; i++) {
        double x = 0.5 * (end[2 * i] + still[2 * i]), y = 0.5 * (end[2 * i + 1] + still[2 * i + 1]);
        double plain[2][WIDTH] = {
            {-inverse[i], 0.0, inverse[i] * x, (end[2 * i] - still[2 * i]) / s->interval, x * y, -(1.0 + x * x), y},
            {0.0, -inverse[i], inverse[i] * y, (end[2 * i + 1] - still[2 * i + 1]) / s->interval, 1.0 + y * y, -x * y,
             -x}};
        for (int r = 0; r < 2; r++)
            for (int c = 0; c < WIDTH; c++)
                rows[(2 * i + r) * WIDTH + c] =
                    s->scale * (root[4 * i + 2 * r] * plain[0][c] + root[4 * i + 2 * r + 1] * plain[1][c]);
        weight[i] = 1.0;
    }
    for (int round = 0; round < ROUNDS; round++) {
        memset(sums, 0, WIDTH * WIDTH * sizeof(double));
        for (int k = 0; k < 2 * n; k++) {
            const double *row = rows + k * WIDTH;
            if (weight[k / 2] == 0.0) continue;
            for (int a = 0; a < WIDTH; a++)
                for (int b = 0; b < WIDTH; b++) sums[a * WIDTH + b] += weight[k / 2] * row[a] * row[b];
        }
        double matrix[6] = {sums[0] + s->prior, sums[1], sums[2], sums[8] + s->prior, sums[9], sums[16] + s->prior};
        double solved[9];
        if (invert(matrix, solved) == 0.0) return 0;
        for (int r = 0; r < 3; r++)
            out[r] = solved[3 * r] * sums[3] + solved[3 * r + 1] * sums[10] + solved[3 * r + 2] * sums[17];
        for (int i = 0; i < n; i++) {
            size[i] = 0.0;
            for (int k = 2 * i; k < 2 * i + 2; k++) {
                const double *row = rows + k * WIDTH;
                double residual = row[0] * out[0] + row[1] * out[1] + row[2] * out[2] - row[3];
                size[i] += residual * residual;
            }
            values[i] = size[i];
        }
        double spread = fmax(MAD_TO_SIGMA * sqrt(upper_median(values, n)), 0.5) * s->gate_sigmas;
        for (int i = 0; i < n; i++) {
            double left = fmax(0.0, 1.0 - size[i] / (spread * spread));
            weight[i] = left * left;
        }
    }
    out[3] = out[4] = out[5] = 0.0;
    for (int i = 0; i < n; i++) out[3] += weight[i] * size[i], out[4] += weight[i], out[5] += weight[i] > 0.1;
    return 1;
}

/* 1/Z of normalised points: the surface's where they lie on it, else the median of five readings, 0 if unknown. */
void flow_depths(const double *bearings, int n, const float *depth, int height, int width, const double *intrinsics,
                 const double *plane, double gate, int cross, int least, double *inverse) {
    long steps[5] = {0, -cross, cross, -(long)cross * width, (long)cross * width};
    for (int i = 0; i < n; i++) {
        double x = bearings[2 * i], y = bearings[2 * i + 1], held[5];
        double u = rint(x * intrinsics[0] + intrinsics[2]), v = rint(y * intrinsics[1] + intrinsics[3]);
        long column = (long)fmin(fmax(u, cross), width - 1 - cross), row = (long)fmin(fmax(v, cross), height - 1 - cross);
        int count = 0;
        for (int k = 0; k < 5; k++) {
            float z = depth[row * width + column + steps[k]];
            if (z > 0.0f && z < INFINITY) held[count++] = z;
        }
        inverse[i] = count >= least ? 1.0f / (float)upper_median(held, count) : 0.0;
        if (plane == NULL || !(inverse[i] > 0.0)) continue;
        double surface = x * plane[0] + y * plane[1] + plane[2];
        if (fabs(inverse[i] - surface) < gate * fabs(surface)) inverse[i] = surface;
    }
}

/* Index within a row of n, mirrored at its ends without repeating them. */
static inline long mirrored(long i, long n) { return i < 0 ? -i : i >= n ? 2 * n - 2 - i : i; }

/* Square root of what following a point tells, along one principal direction: no more than its own error allows. */
static double told(double value, double floor, double noise, double error) {
    double information = fmax(value - floor, 0.0) / noise;
    return sqrt(information / (1.0 + information * error));
}

/* Square roots of the information that following each point carries, symmetric 2 x 2 each. */
void flow_information(const uint8_t *grey, long height, long width, const float *points, int n, int reach, double floor,
                      double noise, double error, double *roots) {
    for (int i = 0; i < n; i++) {
        long u = (long)rintf(points[2 * i]), v = (long)rintf(points[2 * i + 1]);
        double xx = 0.0, xy = 0.0, yy = 0.0;
        for (long dv = -reach; dv <= reach; dv++) {
            long row = v + dv < 0 ? 0 : v + dv >= height ? height - 1 : v + dv;
            const uint8_t *above = grey + mirrored(row - 1, height) * width, *at = grey + row * width;
            const uint8_t *below = grey + mirrored(row + 1, height) * width;
            for (long du = -reach; du <= reach; du++) {
                long c = u + du < 0 ? 0 : u + du >= width ? width - 1 : u + du;
                long l = mirrored(c - 1, width), r = mirrored(c + 1, width);
                int gx = above[r] - above[l] + 2 * (at[r] - at[l]) + below[r] - below[l];
                int gy = below[l] + 2 * below[c] + below[r] - above[l] - 2 * above[c] - above[r];
                xx += gx * gx, xy += gx * gy, yy += gy * gy;
            }
        }
        xx /= 64.0, xy /= 64.0, yy /= 64.0;
        double middle = 0.5 * (xx + yy), half = hypot(0.5 * (xx - yy), xy);
        double high = told(middle + half, floor, noise, error), low = told(middle - half, floor, noise, error);
        double slope = half > 0.0 ? (high - low) / (2.0 * half) : 0.0, level = 0.5 * (high + low);
        roots[4 * i] = level + slope * (xx - middle), roots[4 * i + 3] = level + slope * (yy - middle);
        roots[4 * i + 1] = roots[4 * i + 2] = slope * xy;
    }
}
