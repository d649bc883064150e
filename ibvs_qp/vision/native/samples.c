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
void sample_labels(const uint8_t *rgb, long width, const int16_t *places, long n, const uint8_t *table,
                   uint8_t *labels) {
    for (long i = 0; i < n; i++) labels[i] = (uint8_t)label_of(table, rgb + 3 * (places[2 * i + 1] * width + places[2 * i]));
}

/* Labels of n colours. */
void labels_of(const uint8_t *colors, long n, const uint8_t *table, uint8_t *labels) {
    for (long i = 0; i < n; i++) labels[i] = (uint8_t)label_of(table, colors + 3 * i);
}
