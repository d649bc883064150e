/* What of a picture is read at the samples of the coarse grid: the machine code of grid.py, follow_plane.py, colors.py. */

/* 1/Z of the means of four neighbours at the samples, 0 where absent or out of range. */
void sample_means(const float *depth, long height, long width, const int16_t *corners, const uint8_t *free_of, long n,
                  double nearest, double farthest, double *inverse) {
    for (long i = 0; i < n; i++) {
        long u = corners[2 * i], v = corners[2 * i + 1];
        long left = u < 0 ? 0 : u, right = u + 1 < width ? u + 1 : width - 1;
        long above = (v < 0 ? 0 : v) * width, below = (v + 1 < height ? v + 1 : height - 1) * width;
        float z = 0.25f * depth[above + left] + 0.25f * depth[above + right] + 0.25f * depth[below + left] +
                  0.25f * depth[below + right];
        inverse[i] = free_of[i] && z > nearest && z < farthest ? 1.0 / (double)z : 0.0;
    }
}

/* Labels of the colours at places of a picture. */
void sample_labels(const uint8_t *rgb, long width, const int16_t *places, long n, const uint8_t *levels,
                   const uint8_t *table, uint8_t *labels) {
    for (long i = 0; i < n; i++) {
        long u = places[2 * i], v = places[2 * i + 1];
        labels[i] = (uint8_t)label_of(labels_at(table, levels, width, u, v), rgb + 3 * (v * width + u));
    }
}

/* Labels of n colours, each in light of its level; `levels` is NULL where light is even. */
void labels_of(const uint8_t *colors, long n, const uint8_t *levels, const uint8_t *table, uint8_t *labels) {
    for (long i = 0; i < n; i++)
        labels[i] = (uint8_t)label_of(levels == NULL ? table : table + ((long)levels[i] << 15), colors + 3 * i);
}

/* 1/Z at places of a picture, 0 where absent or out of range. */
void sample_depths(const float *depth, long width, const int16_t *places, long n, double nearest, double farthest,
                   double *inverse) {
    for (long i = 0; i < n; i++) {
        double z = depth[places[2 * i + 1] * width + places[2 * i]];
        inverse[i] = z > nearest && z < farthest ? 1.0 / z : 0.0;
    }
}

static inline float squared_distance(const float *color, const float *reference) {
    float red = color[0] - reference[0], green = color[1] - reference[1], blue = color[2] - reference[2];
    return red * red + green * green + blue * blue;
}

/* Labels of n colours by a colour of the board and, unless it is NULL, one of the paint. */
void like_colors(const uint8_t *colors, long n, const float *board, const float *paint, float gate, uint8_t *labels) {
    for (long i = 0; i < n; i++) {
        float color[3] = {colors[3 * i], colors[3 * i + 1], colors[3 * i + 2]};
        int like = squared_distance(color, board) < gate;
        labels[i] = (uint8_t)(like || paint == NULL ? like : 2 * (squared_distance(color, paint) < gate));
    }
}

/* Labels of all colours in steps of eight grey levels: what is near the paint and not nearer to the board is paint. */
void label_table(const float *board, const float *paint, float gate, uint8_t *table) {
    for (int r = 0; r < 32; r++)
        for (int g = 0; g < 32; g++)
            for (int b = 0; b < 32; b++) {
                float color[3] = {8.0f * (r + 0.5f), 8.0f * (g + 0.5f), 8.0f * (b + 0.5f)};
                float to_board = squared_distance(color, board);
                uint8_t label = to_board < gate;
                if (paint != NULL) {
                    float to_paint = squared_distance(color, paint);
                    label = to_paint < gate && to_paint < to_board ? 2 : label;
                }
                *table++ = label;
            }
}
