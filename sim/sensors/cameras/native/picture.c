/* A whole picture: colours and depths, row by row. */

/* Depths [low, high) of a row of a plane; a factor of NULL is one. */
static void plane_row(const double *plane, double v, int64_t low, int64_t high, float farthest,
                      const float *restrict factor, float *restrict depth)
{
    const float slope = (float)plane[0], constant = (float)(plane[1] * v + plane[2]);
    for (int32_t u = (int32_t)low; u < (int32_t)high; u++) {
        const float inverse = slope * (float)u + constant;
        depth[u] = (factor == NULL ? 1.0f : factor[u]) / (inverse < farthest ? farthest : inverse);
    }
}

static void depth_row(const struct camera *camera, const struct view *view, int64_t v, float *depth)
{
    const int64_t width = camera->columns;
    const float *arm = camera->arm_inverse + v * width;
    const float farthest = (float)camera->farthest, *factor = camera->depth_bank;
    int64_t low = 0, high = width;
    factor = factor == NULL ? NULL : factor + view->depth_noise + v * camera->depth_stride;
    board_columns(view, (double)v, 0.0, &low, &high);
    plane_row(view->wall.plane, (double)v, 0, low, farthest, factor, depth);
    plane_row(view->board.plane, (double)v, low, high, farthest, factor, depth);
    plane_row(view->wall.plane, (double)v, high, width, farthest, factor, depth);
    for (int64_t k = camera->starts[v]; k < camera->starts[v + 1]; k++)
        for (int64_t u = camera->runs[2 * k]; u < camera->runs[2 * k + 1]; u++)
            depth[u] = (factor == NULL ? 1.0f : factor[u]) / arm[u];
}

/* No reading along one edge of the board, ragged, except where arm and brush hide it. */
static void holes(const struct camera *camera, const struct cut *cut, float *depth)
{
    const int flat = cut->flat != 0.0;
    const double along = cut->normal[!flat], across = cut->normal[flat];
    const int64_t limit = flat ? camera->rows : camera->columns, towards = across > 0.0 ? 1 : -1;
    const int64_t stride = flat ? camera->columns : 1, step = flat ? 1 : camera->columns;
    const int64_t *widths = camera->widths + cut->widths;
    for (int64_t place = (int64_t)cut->first; place < (int64_t)cut->end; place++) {
        const double line = floor(-(along * (double)place + cut->offset) / across);
        if (!(fabs(line) < 1e9))
            continue;
        for (int64_t k = -widths[place / HOLE_STEP_PX]; k < 2; k++) {
            const int64_t other = (int64_t)line + k * towards, at = other * stride + place * step;
            if (other >= 0 && other < limit && !camera->mask[at])
                depth[at] = 0.0f;
        }
    }
}

/* rgb: rows x columns x 3; depth [m]: rows x columns, 0 without a reading. */
void draw_picture(const struct camera *camera, const struct view *view, uint8_t *rgb, float *depth)
{
    const int64_t rows = camera->rows, width = camera->columns, room = 3 * (width + SPARE);
    uint8_t *behind = camera->scratch + 12 * (width + SPARE), *ring = behind + room + 4;
    uint16_t *sums = (uint16_t *)(camera->scratch + 28 * (width + SPARE));
    for (int64_t v = 0; v <= rows; v++) {
        if (v < rows) {
            scene_row(camera, view, (double)v, behind, ring + v % 3 * room);
            vehicle_row(camera, v, ring + v % 3 * room);
            depth_row(camera, view, v, depth + v * width);
        }
        if (v > 0) {
            const int64_t here = v - 1, above = here > 0 ? here - 1 : 1, below = v < rows ? v : rows - 2;
            const int8_t *noise = camera->color_bank;
            noise = noise == NULL ? NULL : noise + view->color_noise + 3 * width * here;
            blurred_row(ring + above % 3 * room, ring + here % 3 * room, ring + below % 3 * room, noise, 3 * width,
                        sums, rgb + 3 * width * here);
        }
    }
    if (camera->depth_bank == NULL)
        return;
    for (int64_t k = 0; k < view->count; k++)
        holes(camera, view->cuts + k, depth);
    for (int64_t i = 0; i < camera->holes; i++)
        depth[camera->no_depth[i]] = 0.0f;
}
