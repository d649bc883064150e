/* Rows of a picture: board before wall with a soft rim, vehicle, lens blur and noise. */

/* Columns of a row where every line of the outline is farther than a distance on the board's side. */
static void board_columns(const struct view *view, double v, double distance, int64_t *low, int64_t *high)
{
    for (int64_t k = 0; k < view->count; k++) {
        const struct cut *cut = view->cuts + k;
        narrow(cut->normal[0], cut->normal[1] * v + cut->offset - distance, low, high);
    }
}

/* Pixels [low, high) near the outline: what the board's share, in 256ths, leaves is the wall behind. */
static void mix(const struct view *view, double v, int64_t low, int64_t high, const uint8_t *behind, uint8_t *row)
{
    for (int64_t u = low; u < high; u++)
        for (int64_t k = 0; k < view->count; k++) {
            const struct cut *cut = view->cuts + k;
            const double distance = cut->normal[0] * (double)u + (cut->normal[1] * v + cut->offset);
            const int share = (int)fmin(fmax(256.0 * distance + 128.5, 0.0), 256.0);
            for (int64_t c = 3 * u; c < 3 * u + 3; c++)
                row[c] = (uint8_t)((row[c] * share + behind[c] * (256 - share) + 128) >> 8);
        }
}

/* Board and wall. */
static void scene_row(const struct camera *camera, const struct view *view, double v, uint8_t *behind, uint8_t *row)
{
    const int64_t width = camera->columns;
    int64_t low = 0, high = width, first, end;
    board_columns(view, v, -0.5, &low, &high);
    first = low, end = high;
    board_columns(view, v, 0.5, &first, &end);
    if (first >= end)
        first = end = high;
    sheet_row(camera, &view->board, camera->board, camera->board_rows, camera->board_columns, v, low, high, row);
    sheet_row(camera, &view->wall, camera->wall, camera->wall_rows, camera->wall_columns, v, 0, first, behind);
    sheet_row(camera, &view->wall, camera->wall, camera->wall_rows, camera->wall_columns, v, end, width, behind);
    mix(view, v, low, first, behind, row);
    mix(view, v, end, high, behind, row);
    memcpy(row, behind, (size_t)(3 * low));
    memcpy(row + 3 * high, behind + 3 * high, (size_t)(3 * (width - high)));
}

/* The vehicle's parts before them, and one pixel more at both ends as in a mirror. */
static void vehicle_row(const struct camera *camera, int64_t v, uint8_t *rgb)
{
    const int64_t width = camera->columns, *propellers = camera->propeller_box, *runs = camera->runs;
    if (v >= propellers[0] && v < propellers[1])
        for (int64_t u = propellers[2]; u < propellers[3]; u++)
            if (camera->propellers[v * width + u])
                for (int64_t c = 3 * u; c < 3 * u + 3; c++)
                    rgb[c] = camera->dimmed[rgb[c]];
    for (int64_t k = camera->starts[v]; k < camera->starts[v + 1]; k++)
        memcpy(rgb + 3 * runs[2 * k], camera->arm + 3 * (v * width + runs[2 * k]),
               (size_t)(3 * (runs[2 * k + 1] - runs[2 * k])));
    memcpy(rgb - 3, rgb + 3, 3);
    memcpy(rgb + 3 * width, rgb + 3 * width - 6, 3);
}

/* Binomial blur of three rows, with sensor noise if there is a bank. */
static void blurred_row(const uint8_t *above, const uint8_t *here, const uint8_t *below, const int8_t *noise,
                        int64_t size, uint16_t *sums, uint8_t *out)
{
    above -= 3, here -= 3, below -= 3;
    for (int64_t i = 0; i < size + 6; i++)
        sums[i] = (uint16_t)(above[i] + 2 * here[i] + below[i]);
    if (noise == NULL) {
        for (int64_t i = 0; i < size; i++)
            out[i] = (uint8_t)((sums[i] + 2 * sums[i + 3] + sums[i + 6] + 8) >> 4);
        return;
    }
    for (int64_t i = 0; i < size; i++) {
        const uint16_t sum = (uint16_t)(sums[i] + 2 * sums[i + 3] + sums[i + 6] + 8);
        int16_t noisy = (int16_t)((int16_t)(sum >> 4) + noise[i]);
        noisy = noisy < 0 ? 0 : noisy;
        out[i] = (uint8_t)(noisy > 255 ? 255 : noisy);
    }
}
