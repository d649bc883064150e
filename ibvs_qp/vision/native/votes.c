/* Votes for lines, and which are left when better ones have taken their points: the machine code of vote.py. */

/* How lines are voted for, all at half resolution; see ibvs_qp/vision/native_votes.py. */
typedef struct {
    double low, high, step; /* angles of the normal [rad] */
    double rho_low, rho_high, least, most; /* range of distances, fewest votes, most lines looked at */
    double width, height, moved; /* of the view, and how far down falling edges are moved */
    double near, same, faint, poor, room; /* what takes a point, weakest weights, lines of either polarity */
    double scale, beside; /* samples of the coarse grid per pixel, and where it is compared [samples] */
} Vote;

/* A line that is left: rows at the borders of the view, polarity, weight, share along which its sides differ. */
typedef struct {
    double left, right, falls, weight, differing;
} Voted;

typedef struct {
    int votes, at;
} Peak;

static int by_votes(const void *one, const void *two) {
    const Peak *a = one, *b = two;
    return a->votes != b->votes ? b->votes - a->votes : a->at - b->at;
}

/* Drop peaks that are surely not among the highest `most`; returns how many are left. `levels` has room for the n votes
   that a peak can have. */
static int highest(Peak *peaks, int count, int most, int32_t *levels, int n) {
    int cut = n, above = 0, kept = 0;
    if (count <= most) return count;
    memset(levels, 0, n * sizeof *levels);
    for (int k = 0; k < count; k++) levels[peaks[k].votes - 1]++;
    while (cut > 1 && above + levels[cut - 1] < most) above += levels[--cut];
    for (int k = 0; k < count; k++)
        if (peaks[k].votes >= cut) peaks[kept++] = peaks[k];
    return kept;
}

/* Peaks of the vote of n points, rho and theta of the `most` highest; returns how many, -1 if out of memory. It finds
   what cv2.HoughLinesPointSet finds with a distance step of 1. */
static int hough(const Vote *vote, const float *u, const float *v, int n, float *rho, float *theta) {
    int angles = (int)rint((vote->high - vote->low) / vote->step);
    int rhos = (int)rint(vote->rho_high - vote->rho_low + 1.0), wide = rhos + 2, count = 0;
    const float round_to_whole = 12582912.0f; /* 1.5 2^23: what is added to it is rounded to a whole number */
    long cells = (long)(angles + 2) * wide;
    uint16_t *votes = malloc(cells * sizeof *votes + n * sizeof(int32_t) + cells / 2 * sizeof(Peak) + 32);
    if (votes == NULL) return -1;
    memset(votes, 0, cells * sizeof *votes);
    int32_t *place = (int32_t *)(votes + (cells + 3) / 4 * 4);
    Peak *peaks = (Peak *)(place + (n + 1) / 2 * 2);
    float angle = (float)vote->low, lowest = (float)vote->rho_low;
    for (int k = 0; k < angles; k++, angle += (float)vote->step) {
        float sine = (float)sin(angle), cosine = (float)cos(angle);
        uint16_t *row = votes + (long)(k + 1) * wide + 1;
        for (int i = 0; i < n; i++) {
            float shifted = (u[i] * cosine + v[i] * sine - lowest) + round_to_whole;
            memcpy(place + i, &shifted, sizeof shifted);
        }
        for (int i = 0; i < n; i++) row[place[i] & 0x3FFFFF]++;
    }
    const uint64_t lift = (0x7FFF - (uint64_t)vote->least) * 0x0001000100010001u;
    for (int k = 1; k <= angles; k++)
        for (int r = 1; r <= rhos; r++) {
            const uint16_t *at = votes + (long)k * wide + r;
            uint64_t four; /* votes, all below 2^15 */
            memcpy(&four, at, sizeof four);
            if (!((four + lift) & 0x8000800080008000u)) { /* most places have few */
                r += 3;
                continue;
            }
            if (*at > vote->least && at[0] > at[-1] && at[0] >= at[1] && at[0] > at[-wide] && at[0] >= at[wide])
                peaks[count++] = (Peak){*at, k * wide + r};
        }
    count = highest(peaks, count, (int)vote->most, place, n);
    qsort(peaks, count, sizeof *peaks, by_votes);
    count = count < vote->most ? count : (int)vote->most;
    for (int k = 0; k < count; k++) {
        int row = peaks[k].at / wide;
        rho[k] = lowest + (float)(peaks[k].at - row * wide - 1);
        theta[k] = (float)vote->low + (float)(row - 1) * (float)vote->step;
    }
    free(votes);
    return count;
}

/* Lines (p, q, r) in the order of the weights that are left when better ones have taken their points, at most `room` of
   either polarity; returns how many are kept. Points nearer than `near` count, nearer than `same` they are taken. */
static int distinct_lines(const Vote *vote, const float *lines, const uint8_t *falls, int count, const float *u,
                          const float *v, int32_t *weight, int n, int *kept, double *weights) {
    enum { COUNTS = 1, TAKES = 2 };
    int held = 0, left[2] = {(int)vote->room, (int)vote->room};
    float near = (float)vote->near, same = (float)vote->same;
    int32_t *own = malloc(count * (sizeof(int32_t) + (long)n) + 1);
    if (own == NULL) return -1;
    uint8_t *at = (uint8_t *)(own + count);
    for (int line = 0; line < count; line++) {
        const float *l = lines + 3 * line;
        uint8_t *row = at + (long)line * n;
        int32_t sum = 0;
        for (int k = 0; k < n; k++) {
            float away = fabsf(l[0] * u[k] + l[1] * v[k] + l[2]);
            row[k] = (uint8_t)((away < near) * COUNTS + (away < same) * TAKES);
        }
        for (int k = 0; k < n; k++) sum += (row[k] & COUNTS) * weight[k];
        own[line] = sum;
    }
    for (;;) {
        int best = -1;
        for (int line = 0; line < count; line++)
            if (own[line] >= 0 && (best < 0 || own[line] > own[best])) best = line;
        if (best < 0 || own[best] < fmax(vote->faint, held ? vote->poor * weights[0] : 0.0)) break;
        kept[held] = best, weights[held++] = own[best];
        for (int k = 0; k < n; k++) {
            if (!(at[(long)best * n + k] & TAKES) || !weight[k]) continue;
            for (int line = 0; line < count; line++)
                if (own[line] >= 0) own[line] -= (at[(long)line * n + k] & COUNTS) * weight[k];
            weight[k] = 0;
        }
        own[best] = -1;
        if (--left[falls[best]] == 0)
            for (int line = 0; line < count; line++)
                if (falls[line] == falls[best]) own[line] = -1;
    }
    free(own);
    return held;
}

/* Places along a line, of as many as there are columns, whose two sides have different coarse labels. */
static int differing_labels(const uint8_t *labels, long row_step, long column_step, int rows, int columns, double left,
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

/* Most voted lines of the points (u, v, weight), of which the first `rising` are of one polarity, those with the same
   points left out; `found` has room for twice `room`. `labels` are those of the coarse grid as the view shows it.
   Returns how many, -1 if out of memory. */
int vote_lines(const Vote *vote, const float *points, int rising, int n, const uint8_t *labels, long row_step,
               long column_step, int rows, int columns, Voted *found) {
    int most = (int)vote->most, room = 2 * (int)vote->room, held = -1;
    double *weights = malloc(room * (sizeof(double) + sizeof(int)) + 8 + most * (2 * sizeof(double) + 5 * sizeof(float) + 1) +
                             n * (2 * sizeof(float) + sizeof(int32_t)));
    if (weights == NULL) return -1;
    double *left = weights + room, *right = left + most;
    float *u = (float *)(right + most), *v = u + n, *rho = v + n, *theta = rho + most, *lines = theta + most;
    int *kept = (int *)(lines + 3 * most);
    int32_t *weight = kept + room;
    uint8_t *falls = (uint8_t *)(weight + n);
    for (int k = 0; k < n; k++) {
        u[k] = points[3 * k], v[k] = points[3 * k + 1] + (k < rising ? 0.0f : (float)vote->moved);
        weight[k] = (int32_t)points[3 * k + 2];
    }
    int count = hough(vote, u, v, n, rho, theta);
    for (int k = 0; k < count; k++) {
        double sine = sin(theta[k]), cosine = cos(theta[k]);
        lines[3 * k] = (float)cosine, lines[3 * k + 1] = (float)sine, lines[3 * k + 2] = -rho[k];
        left[k] = rho[k] / sine, right[k] = (rho[k] - vote->width * cosine) / sine;
        falls[k] = 0.5 * (left[k] + right[k]) > 0.5 * (vote->moved + vote->height);
        if (falls[k]) left[k] -= vote->moved, right[k] -= vote->moved;
    }
    if (count >= 0) held = distinct_lines(vote, lines, falls, count, u, v, weight, n, kept, weights);
    for (int k = 0; k < held; k++) {
        int line = kept[k];
        int differ = differing_labels(labels, row_step, column_step, rows, columns, left[line], right[line], vote->scale,
                                      vote->beside);
        found[k] = (Voted){left[line], right[line], falls[line], weights[k], (double)differ / columns};
    }
    free(weights);
    return held;
}
