/* Where each profile across a predicted line has its edge: the machine code of profiles.py, admissible.py, lines.py. */

static const double STEP_SHARE = 0.12, FAINT_SHARE = 0.3, STEP_MIN = 1e-3, ENOUGH = 0.5, OFF_PLANE = 0.018;
static const float PEAK_TO_STEP = 2.5f, TELLING = 0.5f, FLOOR = 0.05f;
static const double PREFERENCE = 0.6;

/* A strip of one line: K profiles of M pixels each. */
typedef struct {
    const Scene *scene;
    const Query *query;
    int profiles, reach, side, pixels, answers;
    int depth_known;
    double *u, *base;
    uint8_t *colors, *hidden;
    float *preference;
} Strip;

/* Pixels of the strip, replicated beyond the picture's border and counted as hidden there. */
static void gather(Strip *strip, double *predicted, uint8_t *visible) {
    const Query *q = strip->query;
    int far = strip->reach + strip->side, height = (int)q->height, middle = far;
    double share = 1.0 / (strip->profiles - 1);
    for (int k = 0; k < strip->profiles; k++) {
        double u = floor(q->first + q->span * (k * share));
        predicted[k] = q->slope * u + q->level;
        double base = fmin(fmax(rint(predicted[k]), -2.0 * far), q->height + 2.0 * far);
        uint8_t *color = strip->colors + 3 * k * strip->pixels, *hidden = strip->hidden + k * strip->pixels;
        strip->u[k] = u, strip->base[k] = base;
        for (int i = 0; i < strip->pixels; i++) {
            int v = (int)base - far + i, inside = v >= 0 && v < height;
            long at = (long)q->row_step * (inside ? v : v < 0 ? 0 : height - 1) + (long)q->column_step * (long)u;
            memcpy(color + 3 * i, strip->scene->rgb + 3 * at, 3);
            hidden[i] = inside ? strip->scene->mask[at] : 255;
        }
        visible[k] = (hidden[middle - 2] | hidden[middle] | hidden[middle + 2]) == 0;
    }
}

static int off_surface(const Strip *strip, int k, int pixel) {
    const Query *q = strip->query;
    double v = strip->base[k] - (strip->reach + strip->side) + pixel;
    double inside = fmin(fmax(v, 0.0), q->height - 1.0);
    long at = (long)q->row_step * (long)inside + (long)q->column_step * (long)strip->u[k];
    double relative = strip->scene->depth[at] * (strip->u[k] * q->surface[0] + v * q->surface[1] + q->surface[2]);
    return relative > 0.0 && fabs(relative - 1.0) > OFF_PLANE;
}

/* The labels that hold in the light at the middle of a profile. */
static const uint8_t *labels_of_profile(const Strip *strip, int k) {
    const Query *q = strip->query;
    const Scene *scene = strip->scene;
    if (scene->levels == NULL) return scene->labels;
    long width = (long)fmax(q->row_step, q->column_step);
    long at = (long)q->row_step * (long)fmin(fmax(strip->base[k], 0.0), q->height - 1.0);
    at += (long)q->column_step * (long)strip->u[k];
    return labels_at(scene->labels, scene->levels, width, at % width, at / width);
}

/* Whether an edge of the line may lie at a place of a profile. */
static int admissible(const Strip *strip, int k, int index) {
    const Query *q = strip->query;
    const uint8_t *hidden = strip->hidden + k * strip->pixels + index;
    int side = strip->side, kind = (int)q->kind;
    if (hidden[0] | hidden[side] | hidden[2 * side]) return 0;
    if (kind == 0) return 1;
    const uint8_t *color = strip->colors + 3 * (k * strip->pixels + index), *labels = labels_of_profile(strip, k);
    int key = 72 * kind + 36 * (int)q->behind + label_of(labels, color) + 3 * label_of(labels, color + 6 * side);
    if (kind == 2 && strip->depth_known)
        key += 9 * off_surface(strip, k, index) + 18 * off_surface(strip, k, index + 2 * side);
    return strip->scene->fits[key];
}

/* Central difference of one channel at a place of a profile. */
static inline float gradient(const Strip *strip, int k, int index, int channel) {
    const uint8_t *color = strip->colors + 3 * (k * strip->pixels + index + strip->side) + channel;
    return 0.5f * ((float)color[3] - (float)color[-3]);
}

/* Sub-pixel place of a Gaussian peak near a whole one; whether it could be one. */
static int peak_near(const float *answer, int size, int reach, int index, double *place, float *peak) {
    int inner = index < 1 ? 1 : index > size - 2 ? size - 2 : index;
    *peak = answer[inner];
    float scale = fmaxf(*peak, 1e-6f);
    float before = logf(fmaxf(answer[inner - 1] / scale, FLOOR)), behind = logf(fmaxf(answer[inner + 1] / scale, FLOOR));
    float curvature = fminf(before + behind, -1e-6f);
    float shift = (before - behind) * 0.5f / curvature;
    shift = fminf(fmaxf(shift, -0.7f), 0.7f) * (curvature < -2e-6f);
    *place = (double)(inner - reach) + shift;
    return index == inner;
}

static int strongest(const float *answer, const float *preference, int size) {
    int best = 0;
    for (int i = 1; i < size; i++)
        if (answer[i] * preference[i] > answer[best] * preference[best]) best = i;
    return best;
}

/* Mix of channels that shows a new line: the typical strongest step of the strip. */
static void direction_of(const Strip *strip, float *scratch, double *sorted, double *direction) {
    int profiles = strip->profiles, count = 0, polarity = (int)strip->query->polarity;
    float *weight = scratch, *steps = scratch + profiles;
    for (int k = 0; k < profiles; k++) {
        int best = 0, strongest = 0; /* in whole numbers: twice the gradients */
        const uint8_t *color = strip->colors + 3 * (k * strip->pixels + strip->side);
        for (int i = 0; i < strip->answers; i++, color += 3) {
            int red = color[3] - color[-3], green = color[4] - color[-2], blue = color[5] - color[-1], most;
            if (polarity == 0) red = abs(red), green = abs(green), blue = abs(blue);
            else red *= polarity, green *= polarity, blue *= polarity;
            most = red > green ? red : green;
            most = most > blue ? most : blue;
            if (most > strongest && admissible(strip, k, i)) strongest = most, best = i;
        }
        weight[k] = 0.5f * (float)strongest;
        sorted[k] = weight[k];
        for (int c = 0; c < 3; c++) steps[3 * k + c] = gradient(strip, k, best, c);
    }
    float least = TELLING * (float)upper_median(sorted, profiles);
    for (int c = 0; c < 3; c++) {
        count = 0;
        for (int k = 0; k < profiles; k++)
            if (weight[k] > least) sorted[count++] = steps[3 * k + c];
        direction[c] = count ? PEAK_TO_STEP * (float)upper_median(sorted, count) : 0.0f;
    }
}

/* Second look at the profiles whose strongest answer is no edge of the line: only places that may be one.

   The border of the surface is known by its two sides: beyond it the wall may change from brick to joint, and where the
   known step fails any step counts. */
static void look_again(const Strip *strip, float *answers, uint8_t *allowed, float *masked, double limit, double faint,
                       double *row, uint8_t *good) {
    enum { SKIPPED, REFUSED = 2, ALLOWED };
    int size = strip->answers, board = strip->query->board != 0.0 && strip->depth_known;
    double lowered = limit;
    for (int k = 0; k < strip->profiles; k++) {
        float *answer = answers + k * size, most = -INFINITY, most_allowed = -INFINITY;
        allowed[k * size] = SKIPPED;
        if (good[k]) continue;
        for (int i = 0; i < size; i++) most = fmaxf(most, answer[i]);
        if (!(most > limit) && !board) continue;
        for (int i = 0; i < size; i++) {
            int may = admissible(strip, k, i);
            allowed[k * size + i] = may ? ALLOWED : REFUSED;
            most_allowed = fmaxf(most_allowed, may ? answer[i] : 0.0f);
        }
        if (!board || !(most_allowed < limit)) continue;
        lowered = faint;
        for (int i = 0; i < size; i++) {
            float r = gradient(strip, k, i, 0), g = gradient(strip, k, i, 1), b = gradient(strip, k, i, 2);
            answer[i] = sqrtf(r * r + g * g + b * b);
        }
    }
    for (int k = 0; k < strip->profiles; k++) {
        const float *answer = answers + k * size;
        double place;
        float peak;
        if (good[k] || allowed[k * size] == SKIPPED) continue;
        for (int i = 0; i < size; i++) masked[i] = allowed[k * size + i] == ALLOWED ? answer[i] : 0.0f;
        int index = strongest(masked, strip->preference, size);
        int inner = peak_near(answer, size, strip->reach, index, &place, &peak);
        good[k] = inner && allowed[k * size + index] == ALLOWED && peak > lowered;
        row[k] = strip->base[k] + place;
    }
}

/* Sub-pixel row of every profile's edge, and whether it has one. The strongest answer of every profile is looked at
   first; only where too few of a line are edges, its other places are judged. */
static void find_edges(const Strip *strip, const float *unit, double limit, double faint, const uint8_t *visible,
                       float *answers, uint8_t *allowed, double *row, uint8_t *good) {
    int size = strip->answers, expected = 0, found = 0;
    float *mixed = answers + strip->profiles * size;
    for (int k = 0; k < strip->profiles; k++) {
        float *answer = answers + k * size, peak;
        double place;
        const uint8_t *color = strip->colors + 3 * (k * strip->pixels + strip->side - 1);
        for (int i = 0; i < size + 2; i++)
            mixed[i] = color[3 * i] * unit[0] + color[3 * i + 1] * unit[1] + color[3 * i + 2] * unit[2];
        for (int i = 0; i < size; i++) answer[i] = mixed[i + 2] - mixed[i];
        int index = strongest(answer, strip->preference, size);
        int inner = peak_near(answer, size, strip->reach, index, &place, &peak);
        good[k] = inner && peak > limit && admissible(strip, k, index);
        row[k] = strip->base[k] + place;
        found += good[k];
        expected += visible[k] && strip->u[k] >= strip->query->seen_from && strip->u[k] <= strip->query->seen_to;
    }
    if (found < ENOUGH * expected) look_again(strip, answers, allowed, mixed, limit, faint, row, good);
}
