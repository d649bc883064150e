/* What lies on the two sides of fitted lines: the machine code of classify.py. */

/* One line with n profiles; see ibvs_qp/vision/native_sides.py. */
typedef struct {
    double n, cosine, sine, rho, low, high; /* and the range of its segment along it, normalised */
} Edge;

/* What the two sides of a line show, before and behind. */
typedef struct {
    double board[2], paint[2]; /* shares of the profiles */
    double farther[2], readings[2]; /* share of depth beyond the surface, readings that tell it: 0 for too few */
    double samples[2]; /* of the surface, abreast of the segment and clear of the line */
} Evidence;

typedef struct {
    double height, width, fx, fy, cx, cy; /* of the picture [px] */
    double plane[3], known; /* of the surface, if it is known */
    double distances[3], valid; /* at which depth is read [px], and least share of valid readings */
    double samples, margin; /* of the surface, and how far from a line they count, normalised */
} Look;

/* Median depth beside a line as a share of the surface's, less 1, and the readings that tell it. */
static int beside(const Look *look, const Edge *edge, const double *pixels, const float *depth, const uint8_t *mask,
                  double reach, double *values, double *farther) {
    const double *p = look->plane;
    double a = p[0] / look->fx, b = p[1] / look->fy, c = p[2] - p[0] * look->cx / look->fx - p[1] * look->cy / look->fy;
    int n = (int)edge->n, held = 0;
    for (int k = 0; k < n; k++) {
        double u = rint(pixels[2 * k] + reach * edge->cosine), v = rint(pixels[2 * k + 1] + reach * edge->sine);
        if (!(u >= 0.0 && u < look->width && v >= 0.0 && v < look->height)) continue;
        long at = (long)v * (long)look->width + (long)u;
        double relative = depth[at] * (a * u + b * v + c);
        if (depth[at] > 0.0f && depth[at] < INFINITY && mask[at] == 0 && isfinite(relative)) values[held++] = relative;
    }
    if (held < fmax(look->valid * n, 5.0)) return 0;
    *farther = upper_median(values, held) - 1.0;
    return held;
}

/* Look at all lines; `colors` are those before all lines and then those behind, `labels` and
   `levels` may be NULL. 0 if out of
   memory. */
int identify(const Look *look, const Edge *edges, int lines, const double *pixels, const uint8_t *colors, long total,
             const uint8_t *labels, const uint8_t *levels, const float *depth, const uint8_t *mask, const double *design,
             const uint8_t *component, Evidence *found) {
    double *values = malloc((total + 1) * sizeof(double));
    if (values == NULL) return 0;
    for (int line = 0; line < lines; line++, edges++, found++) {
        int n = (int)edges->n;
        memset(found, 0, sizeof *found);
        for (int side = 0; side < 2; side++) {
            const uint8_t *color = colors + 3 * total * side;
            for (int k = 0; k < n && labels != NULL; k++) {
                long u = (long)fmin(fmax(pixels[2 * k], 0.0), look->width - 1.0);
                long v = (long)fmin(fmax(pixels[2 * k + 1], 0.0), look->height - 1.0);
                int label = label_of(labels_at(labels, levels, (long)look->width, u, v), color + 3 * k);
                found->board[side] += label == BOARD;
                found->paint[side] += label == PAINT;
            }
            found->board[side] /= n > 1 ? n : 1, found->paint[side] /= n > 1 ? n : 1;
            for (int d = 0; d < 3 && look->known != 0.0 && found->readings[side] == 0.0; d++)
                found->readings[side] = beside(look, edges, pixels, depth, mask,
                                               (side ? 1.0 : -1.0) * look->distances[d], values, &found->farther[side]);
        }
        for (long i = 0; i < (long)look->samples && look->known != 0.0; i++) {
            const double *at = design + 3 * i;
            if (!component[i]) continue;
            double along = at[1] * edges->cosine - at[0] * edges->sine;
            double across = at[0] * edges->cosine + at[1] * edges->sine - edges->rho;
            if (!(along > edges->low && along < edges->high)) continue;
            found->samples[0] += across < -look->margin;
            found->samples[1] += across > look->margin;
        }
        pixels += 2 * n, colors += 3 * n;
    }
    free(values);
    return 1;
}
