/* Points that vote for lines: where a thinned-out picture steps up or down. The machine code of edge_points.py. */

enum { CHANNELS = 3, SHARE_BITS = 11, ONE_SHARE = 1 << SHARE_BITS, HALF_SHARE = ONE_SHARE / 2 };

/* A thinned-out picture and what of the full one it shows; see ibvs_qp/vision/native_votes.py. */
typedef struct {
    double rows, columns; /* of the thinned-out picture */
    double upright, height, width; /* whether lines are sought that stand, and size of the picture itself */
    double threshold, full, most; /* weakest step, the step of a full vote [grey levels], most points */
    double grid_rows, grid_columns, stride; /* of the region */
} Thin;

/* Of which two pixels each of n is mixed, and the share of the second in 2048ths: as cv2.resize mixes. */
static int shares_of(int n, int size, int *at, int *share) {
    double scale = 1.0 / ((double)n / size);
    int halves = 1;
    for (int k = 0; k < n; k++) {
        float place = (float)((k + 0.5) * scale - 0.5), whole = floorf(place);
        at[k] = (int)whole, share[k] = (int)lrintf((place - whole) * ONE_SHARE);
        if (at[k] < 0) at[k] = 0, share[k] = 0;
        if (at[k] >= size - 1) at[k] = size > 1 ? size - 2 : 0, share[k] = ONE_SHARE;
        halves &= share[k] == HALF_SHARE;
    }
    return halves;
}

/* One row of the thinned-out picture, channel after channel, from two rows of the picture, of which the second has a
   share; `halves`: everything is the mean of four pixels, and two bytes beyond each may be read. */
static void thin_row(const uint8_t *one, const uint8_t *two, int second, const int *at, const int *share, int n,
                     int halves, uint8_t *restrict row) {
    const uint64_t even = 0x00FF00FF00FF00FFu;
    for (int c = 0; c < n && halves; c++) {
        uint64_t p, q;
        memcpy(&p, one + CHANNELS * at[c], sizeof p);
        memcpy(&q, two + CHANNELS * at[c], sizeof q);
        uint64_t low = (p & even) + (q & even), high = (p >> 8 & even) + (q >> 8 & even);
        uint64_t outer = low + (high >> 16), inner = high + (low >> 32); /* red and blue, and green, of both pixels */
        row[c] = (uint8_t)(((outer & 0xFFFF) + 2) >> 2);
        row[n + c] = (uint8_t)(((inner & 0xFFFF) + 2) >> 2);
        row[2 * n + c] = (uint8_t)(((outer >> 16 & 0xFFFF) + 2) >> 2);
    }
    for (int c = 0; c < n && !halves; c++)
        for (int k = 0; k < CHANNELS; k++) {
            const uint8_t *a = one + CHANNELS * at[c] + k, *b = two + CHANNELS * at[c] + k;
            int above = a[0] * (ONE_SHARE - share[c]) + a[CHANNELS] * share[c];
            int below = b[0] * (ONE_SHARE - share[c]) + b[CHANNELS] * share[c];
            int sum = ((ONE_SHARE - second) * (above >> 4) >> 16) + (second * (below >> 4) >> 16);
            row[k * n + c] = (uint8_t)((sum + 2) >> 2);
        }
}

/* The largest step among the channels, from one row to another and back. */
static void steps_between(const uint8_t *from, const uint8_t *to, int n, int stride, uint8_t *restrict rising,
                          uint8_t *restrict falling) {
    for (int c = 0; c < n; c++) {
        uint8_t up = 0, down = 0;
        for (int k = 0; k < CHANNELS; k++) {
            uint8_t a = from[k * stride + c], b = to[k * stride + c], most = a > b ? a : b;
            uint8_t rise = (uint8_t)(most - a), fall = (uint8_t)(most - b);
            up = up > rise ? up : rise, down = down > fall ? down : fall;
        }
        rising[c] = up, falling[c] = down;
    }
}

/* Steps that are strong and no weaker than those before and behind, 0 elsewhere. */
static void keep_strongest(const uint8_t *steps, const uint8_t *before, const uint8_t *behind, int n, uint8_t threshold,
                           uint8_t *restrict strong) {
    for (int c = 0; c < n; c++) {
        uint8_t keep = (uint8_t)((steps[c] > threshold) & (steps[c] >= before[c]) & (steps[c] > behind[c]));
        strong[c] = keep ? steps[c] : 0;
    }
}

/* Strongest steps of either polarity in the view in which lines are level, (2, rows, columns) of it; `strong` is all 0.
   `steps` is 0 too and has room for two channels of the thinned-out picture, `scratch` for all of it and a row. */
static void strongest_steps(const Thin *thin, const uint8_t *rgb, const int *table, uint8_t *scratch, uint8_t *steps,
                            uint8_t *strong) {
    int rows = (int)thin->rows, columns = (int)thin->columns, width = (int)thin->width, upright = thin->upright != 0.0;
    const int *across = table, *second = across + rows, *along = second + rows, *share = along + columns;
    long line = CHANNELS * (long)width, wide = CHANNELS * (long)columns, size = (long)rows * columns;
    int halves = table[2 * (rows + columns)];
    uint8_t threshold = (uint8_t)thin->threshold, *row = scratch;
    long view = upright ? (long)rows * (columns - 2) : (long)columns * (rows - 2);
    for (int r = 0; r < rows; r++) {
        const uint8_t *one = rgb + across[r] * line;
        row = scratch + (upright ? 0 : r * wide);
        thin_row(one, one + line, second[r], along, share, columns, halves, row);
        if (!upright && r >= 2)
            steps_between(row - 2 * wide, row, columns, columns, steps + (r - 1) * columns,
                          steps + size + (r - 1) * columns);
        if (!upright) continue;
        uint8_t *found = row + wide, *step = steps + 1, *back = steps + columns + 1;
        steps_between(row, row + 2, columns - 2, columns, step, back);
        for (int falls = 0; falls < 2; falls++, step = back) {
            keep_strongest(step, step - 1, step + 1, columns - 2, threshold, found);
            for (int first = 0; first < columns - 2; first += 8) { /* most places are flat */
                uint64_t eight;
                memcpy(&eight, found + first, sizeof eight);
                for (int c = first; eight && c < columns - 2; c++, eight >>= 8)
                    if (eight & 0xFF) strong[falls * view + (long)c * rows + r] = (uint8_t)eight;
            }
        }
    }
    for (int r = 1; r < rows - 1 && !upright; r++)
        for (int falls = 0; falls < 2; falls++) {
            const uint8_t *step = steps + falls * size + r * columns;
            keep_strongest(step, step - columns, step + columns, columns, threshold,
                           strong + falls * view + (r - 1) * columns);
        }
}

/* Points of one polarity that nothing hides and around which lines are wanted: u, v at half resolution and weight each,
   the strongest ones if there are more than fit; returns how many. `held` has room for one int per step,
   and two per column. */
static int points_of(const Thin *thin, const uint8_t *strong, const uint8_t *mask, const uint8_t *region, int *held,
                     float *points) {
    int upright = thin->upright != 0.0, full = (int)thin->full, most = (int)thin->most, count = 0;
    int rows = (int)(upright ? thin->columns : thin->rows) - 2, columns = (int)(upright ? thin->rows : thin->columns);
    int width = (int)thin->width, stride = (int)thin->stride, cells = (int)thin->grid_columns;
    int last_row = (int)thin->grid_rows - 1, last_cell = cells - 1;
    float across = (float)((upright ? thin->width : thin->height) / (rows + 2));
    float along = (float)((upright ? thin->height : thin->width) / columns);
    long levels[256] = {0}, cut = full, above = 0, seen = 0, kept = 0;
    int *pixel = held + (long)rows * columns, *cell = pixel + columns;
    for (int c = 0; c < columns; c++) { /* what the columns of the view count in mask and region */
        int at = (int)((c + 0.5f) * along), last = upright ? last_row : last_cell;
        int of = at / stride < last ? at / stride : last;
        pixel[c] = upright ? at * width : at, cell[c] = upright ? of * cells : of;
    }
    for (int r = 0; r < rows; r++) {
        const uint8_t *row = strong + (long)r * columns;
        int at = (int)((r + 1.5f) * across), last = upright ? last_cell : last_row;
        int of = at / stride < last ? at / stride : last;
        const uint8_t *hidden = mask + (upright ? at : (long)at * width);
        const uint8_t *wanted = region == NULL ? NULL : region + (upright ? of : (long)of * cells);
        for (int first = 0; first < columns; first += 8) { /* most places are flat */
            uint64_t eight;
            memcpy(&eight, row + first, sizeof eight);
            for (int c = first; eight; c++, eight >>= 8) {
                if (!(eight & 0xFF) || c >= columns) continue;
                /* the mask is as large as the picture: it is asked last */
                int free_of = (wanted == NULL || wanted[cell[c]] != 0) && hidden[pixel[c]] == 0;
                levels[row[c] < full ? row[c] : full] += free_of;
                held[count] = r * columns + c, count += free_of;
            }
        }
    }
    if (count > most) { /* the strongest, and of the last of these as many as there is room for, evenly spread */
        while (above + levels[cut] < most) above += levels[cut--];
    } else cut = 0;
    for (int k = 0; k < count; k++) {
        int strength = strong[held[k]] < full ? strong[held[k]] : full;
        if (strength < cut) continue;
        if (cut && strength == cut) {
            long room = most - above, all = levels[cut], before = seen++ * room / all;
            if (seen * room / all == before) continue;
        }
        int r = held[k] / columns, c = held[k] - r * columns;
        float *point = points + 3 * kept++;
        point[0] = 0.5f * ((c + 0.5f) * along), point[1] = 0.5f * ((r + 1.5f) * across), point[2] = (float)strength;
    }
    return (int)kept;
}

/* Points where the colours step up along v, `counts[0]` of them, and then those where they step down, `counts[1]`;
   `points` has room for twice the most. 0 if out of memory. */
int edge_points(const Thin *thin, const uint8_t *rgb, const uint8_t *mask, const uint8_t *region, float *points,
                int32_t *counts) {
    int rows = (int)thin->rows, columns = (int)thin->columns, height = (int)thin->height, width = (int)thin->width;
    long size = (long)rows * columns, numbers = 2 * (rows + columns) + 1 + size + 2 * (rows + columns);
    uint8_t *memory = malloc(numbers * sizeof(int) + (CHANNELS + 4) * size + 8 * columns + 16);
    if (memory == NULL) return 0;
    int *table = (int *)memory, *along = table + 2 * rows, *held = along + 2 * columns + 1;
    uint8_t *strong = (uint8_t *)(held + size + 2 * (rows + columns)), *steps = strong + 2 * size + 8;
    uint8_t *scratch = steps + 2 * size + 8;
    memset(strong, 0, 4 * size + 16);
    int halves = shares_of(rows, height, table, table + rows);
    halves &= shares_of(columns, width, along, along + columns);
    /* the mean of four pixels reads two bytes too far */
    table[2 * (rows + columns)] = halves && (along[columns - 1] + 2 < width || table[rows - 1] + 2 < height);
    strongest_steps(thin, rgb, table, scratch, steps, strong);
    long view = thin->upright != 0.0 ? (long)rows * (columns - 2) : (long)columns * (rows - 2);
    counts[0] = points_of(thin, strong, mask, region, held, points);
    counts[1] = points_of(thin, strong + view, mask, region, held, points + 3 * counts[0]);
    free(memory);
    return 1;
}
