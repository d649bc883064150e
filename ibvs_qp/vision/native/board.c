/* What samples of the coarse grid tell of board, light and paint: the machine code of board_samples.py,
   light_samples.py, colors.py and paint_light.py. */

enum { WINDOW_MAX = 441 }; /* the largest window around a seed: 21 by 21 samples */

/* When a colour is the surface's; see ibvs_qp/vision/native_colors.py. */
typedef struct {
    float apart, sure, tint; /* squared gate of a colour, squared gate of a sure one, gate of the tint */
    float dimmest, brightest, cut, uneven; /* light looked at, what is cut off, and what is even */
} Gates;

/* Upper median colours of windows of samples around seeds. */
void seed_colors(const uint8_t *colors, const int64_t *windows, long seeds, long width, float *medians) {
    uint8_t sorted[WINDOW_MAX];
    for (long seed = 0; seed < seeds; seed++)
        for (int c = 0; c < 3; c++) {
            for (long k = 0; k < width; k++) {
                uint8_t value = colors[3 * windows[seed * width + k] + c];
                long at = k;
                for (; at > 0 && sorted[at - 1] > value; at--) sorted[at] = sorted[at - 1];
                sorted[at] = value;
            }
            medians[3 * seed + c] = sorted[width / 2];
        }
}

static void color_at(const uint8_t *colors, long at, float *color) {
    for (int c = 0; c < 3; c++) color[c] = colors[3 * at + c];
}

/* Upper median colour of the surface's samples that are not the paint's and, where the board is known and enough are
   like it, are; at most `judged` to twice as many are looked at. Returns how many there are, -1 if out of memory. */
long board_samples(const uint8_t *colors, const uint8_t *component, long n, const float *paint, const float *board,
                   float apart, long judged, float *median) {
    int32_t *kept = malloc((2 * n + 1) * sizeof *kept), *near = kept + n;
    long count = 0, like = 0, histogram[3][256] = {{0}};
    if (kept == NULL) return -1;
    for (long k = 0; k < n; k++) {
        float color[3];
        if (!component[k]) continue;
        color_at(colors, k, color);
        if (paint != NULL && !(squared_distance(color, paint) > apart)) continue;
        kept[count++] = (int32_t)k;
        if (board != NULL && squared_distance(color, board) < apart) near[like++] = (int32_t)k;
    }
    const int32_t *chosen = board == NULL ? kept : near;
    if (board != NULL) count = like > count / 4 ? like : 0;
    long step = count / judged > 1 ? count / judged : 1, looked = (count + step - 1) / step;
    for (long k = 0; k < count; k += step)
        for (int c = 0; c < 3; c++) histogram[c][colors[3 * (long)chosen[k] + c]]++;
    for (int c = 0; c < 3 && count; c++) {
        long below = 0, value = 0;
        while (below + histogram[c][value] <= looked / 2) below += histogram[c][value++];
        median[c] = (float)value;
    }
    free(kept);
    return count;
}

/* Those of n samples of the grid that lie on a surface by depth alone, (a, b, c) of 1/Z; returns how many. */
long on_surface(const float *depth, const int64_t *pixels, const double *design, const int64_t *places, long n,
                const double *plane, double gate, int64_t *near) {
    long count = 0;
    for (long k = 0; k < n; k++) {
        double z = depth[pixels[k]], expected = design[3 * k] * plane[0] + design[3 * k + 1] * plane[1] + plane[2];
        near[count] = places[k];
        count += fabs(z * expected - 1.0) < gate;
    }
    return count;
}

/* Of n samples that are not the paint's, how many have the surface's tint in some light, and how many its colour in the
   reference's. */
void even_light(const uint8_t *colors, const int64_t *places, long n, const float *paint, const float *board,
                const Gates *gates, int32_t *counts) {
    float size = board[0] * board[0] + board[1] * board[1] + board[2] * board[2];
    size = fmaxf(size, 1.0f);
    counts[0] = counts[1] = 0;
    for (long k = 0; k < n; k++) {
        float color[3];
        color_at(colors, places[k], color);
        if (paint != NULL && !(squared_distance(color, paint) > gates->apart)) continue;
        float light = (color[0] * board[0] + color[1] * board[1] + color[2] * board[2]) / size;
        float whole = color[0] * color[0] + color[1] * color[1] + color[2] * color[2];
        float off = fmaxf(whole - light * light * size, 0.0f), tint = gates->tint * light;
        int tinted = light > gates->dimmest && light < gates->brightest && off < tint * tint;
        tinted |= fmaxf(fmaxf(color[0], color[1]), color[2]) >= gates->cut;
        counts[0] += tinted;
        counts[1] += tinted && squared_distance(color, board) < gates->sure && fabsf(light - 1.0f) < gates->uneven;
    }
}

/* Samples of n that have the paint's tint in some light, and the median light of them; -1 if out of memory. */
long painted_light(const uint8_t *colors, const int64_t *places, long n, const float *paint, const float *board,
                   const Gates *gates, float *found) {
    float size = fmaxf(paint[0] * paint[0] + paint[1] * paint[1] + paint[2] * paint[2], 1.0f), color[3], off[3];
    double *light = malloc((n + 1) * sizeof *light), below = 0.0;
    long count = 0;
    if (light == NULL) return -1;
    for (long k = 0; k < n; k++) {
        color_at(colors, places[k], color);
        float own = (color[0] * paint[0] + color[1] * paint[1] + color[2] * paint[2]) / size, tint = gates->tint * own;
        for (int c = 0; c < 3; c++) off[c] = own * paint[c];
        if (!(own > gates->dimmest && own < gates->brightest && squared_distance(color, off) < tint * tint)) continue;
        if (squared_distance(color, board) > gates->apart) light[count++] = own;
    }
    double above = upper_median(light, (int)count);
    for (long k = 0; k < count / 2; k++) below = fmax(below, light[k]);
    *found = count % 2 ? (float)above : ((float)above + (float)below) / 2.0f;
    free(light);
    return count;
}
