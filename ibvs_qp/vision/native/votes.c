/* Points that vote for lines, and which lines are left when better ones have taken theirs: the machine code of
   edge_points.py and vote.py. */

/* Steps in a thinned-out picture and what of the full one it shows; see ibvs_qp/vision/native_votes.py. */
typedef struct {
    double rows, columns; /* of the steps, two rows less than the view in which lines are level */
    double upright, height, width; /* of the picture itself */
    double threshold, full, most; /* weakest step, the step of a full vote [grey levels], most points */
    double grid_rows, grid_columns, stride; /* of the region */
} Thin;

/* Places of a row where the step is strong and no weaker than in the rows beside it; the last row has none behind. */
static void strongest_of(const uint8_t *row, const uint8_t *above, const uint8_t *below, int n, uint8_t threshold,
                         uint8_t *restrict strong) {
    for (int c = 0; c < n; c++) strong[c] = (row[c] > threshold) & (row[c] >= above[c]);
    if (below == NULL) return;
    for (int c = 0; c < n; c++) strong[c] &= row[c] > below[c];
}

/* Points where the step across the line is strong and the strongest: u, v at half resolution and weight each; returns
   how many. */
int edge_points(const Thin *thin, const uint8_t *steps, const uint8_t *mask, const uint8_t *region, float *points) {
    int rows = (int)thin->rows, columns = (int)thin->columns, upright = thin->upright != 0.0, count = 0;
    int threshold = (int)thin->threshold, full = (int)thin->full, most = (int)thin->most;
    int width = (int)thin->width, stride = (int)thin->stride, cells = (int)thin->grid_columns;
    int last_along = upright ? (int)thin->grid_rows - 1 : cells - 1;
    int last_across = upright ? cells - 1 : (int)thin->grid_rows - 1;
    float across = (float)((upright ? thin->width : thin->height) / (rows + 2));
    float along = (float)((upright ? thin->height : thin->width) / columns);
    long levels[256] = {0};
    int *pixel = malloc(2 * columns * sizeof(int) + columns + 8), *cell = pixel + columns;
    if (pixel == NULL) return -1;
    uint8_t *strong = (uint8_t *)(cell + columns);
    memset(strong, 0, columns + 8);
    for (int c = 0; c < columns; c++) { /* what the columns of the view count in mask and region */
        int at = (int)((c + 0.5f) * along), of = at / stride < last_along ? at / stride : last_along;
        pixel[c] = upright ? at * width : at, cell[c] = upright ? of * cells : of;
    }
    for (int r = 0; r < rows; r++) {
        const uint8_t *row = steps + r * columns, *above = r ? row - columns : row;
        float v = (r + 1.5f) * across;
        int at = (int)v, of = at / stride < last_across ? at / stride : last_across;
        int row_pixel = upright ? at : at * width, row_cell = upright ? of : of * cells;
        strongest_of(row, above, r + 1 < rows ? row + columns : NULL, columns, (uint8_t)threshold, strong);
        for (int c = 0; c < columns; c++) {
            uint64_t eight;
            memcpy(&eight, strong + c, sizeof eight);
            if (eight == 0) c += 7; /* most places are flat */
            if (eight == 0 || !strong[c] || mask[row_pixel + pixel[c]]) continue;
            if (region != NULL && !region[row_cell + cell[c]]) continue;
            const uint8_t *step = row + c;
            float u = (c + 0.5f) * along;
            int strength = *step < full ? *step : full;
            levels[strength]++;
            points[3 * count] = 0.5f * u, points[3 * count + 1] = 0.5f * v, points[3 * count + 2] = (float)strength;
            count++;
        }
    }
    free(pixel);
    long cut = full, above = 0, seen = 0, held = 0;
    if (count > most) { /* the strongest, and of the last of these as many as there is room for, evenly spread */
        while (above + levels[cut] < most) above += levels[cut--];
    } else cut = 0;
    for (int k = 0; k < count; k++) {
        const float *point = points + 3 * k;
        long strength = (long)point[2];
        if (strength < cut) continue;
        if (cut && strength == cut) {
            long room = most - above, all = levels[cut], before = seen++ * room / all;
            if (seen * room / all == before) continue;
        }
        float *kept = points + 3 * held++;
        kept[0] = point[0], kept[1] = point[1], kept[2] = (float)strength;
    }
    return (int)held;
}

/* Lines (p, q, r) in the order of the votes that are left when better ones have taken theirs, at most `room` of either
   polarity; returns how many are kept. Points nearer than `near` vote, nearer than `same` they are taken. */
int distinct_lines(const float *lines, const uint8_t *falls, int count, const float *points, int n, float near, float same,
                   double faint, double poor, int room, int32_t *kept, double *votes) {
    float *u = malloc(2 * n * sizeof(float) + n * sizeof(int32_t) + (long)count * n + count), *v = u + n;
    if (u == NULL) return -1;
    int32_t *weight = (int32_t *)(v + n);
    uint8_t *at = (uint8_t *)(weight + n), *wanted = at + (long)count * n;
    int held = 0, left[2] = {room, room};
    for (int k = 0; k < n; k++)
        u[k] = points[3 * k], v[k] = points[3 * k + 1], weight[k] = (int32_t)points[3 * k + 2];
    for (int line = 0; line < count; line++) {
        const float *l = lines + 3 * line;
        wanted[line] = 1;
        for (int k = 0; k < n; k++) {
            float away = fabsf(l[0] * u[k] + l[1] * v[k] + l[2]);
            at[(long)line * n + k] = (uint8_t)((away < near) + 2 * (away < same));
        }
    }
    for (;;) {
        int best = -1;
        int32_t most = 0;
        for (int line = 0; line < count; line++) {
            int32_t own = 0;
            const uint8_t *row = at + (long)line * n;
            if (!wanted[line]) continue;
            for (int k = 0; k < n; k++) own += (row[k] & 1) * weight[k];
            if (best < 0 || own > most) best = line, most = own;
        }
        if (best < 0 || most < fmax(faint, held ? poor * votes[0] : 0.0)) break;
        kept[held] = best, votes[held++] = most;
        for (int k = 0; k < n; k++)
            if (at[(long)best * n + k] & 2) weight[k] = 0;
        wanted[best] = 0;
        if (--left[falls[best]] == 0)
            for (int line = 0; line < count; line++) wanted[line] &= falls[line] != falls[best];
    }
    free(u);
    return held;
}

/* Places along a line, of as many as there are columns, whose two sides have different coarse labels. */
int differing_labels(const uint8_t *labels, long row_step, long column_step, int rows, int columns, double left,
                     double right, double scale, double beside) {
    int count = 0;
    for (int c = 0; c < columns; c++) {
        double level = (left + (right - left) * ((c + 0.5) / columns)) * scale - 0.5;
        double above = rint(level - beside), below = rint(level + beside);
        if (!(above >= 0.0 && below < rows)) continue;
        const uint8_t *column = labels + c * column_step;
        count += column[(long)above * row_step] != column[(long)below * row_step];
    }
    return count;
}
