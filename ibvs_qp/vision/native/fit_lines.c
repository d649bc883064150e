/* Sub-pixel fits of predicted lines: the machine code of lines.py, called by ibvs_qp/vision/native_lines.py. */

/* What the fit of one line needs, all lines one after the other. */
typedef struct {
    double *u, *base, *predicted, *row, *distance;
    uint8_t *colors, *hidden, *visible, *good;
} Lines;

static Strip strip_of(const Scene *scene, const Query *queries, const Setting *s, const Lines *all, int line,
                      float *preference) {
    int profiles = (int)s->profiles, reach = (int)s->reach, side = (int)s->side, pixels = 2 * (reach + side) + 1;
    return (Strip){.scene = scene, .query = queries + line, .profiles = profiles, .reach = reach, .side = side,
                   .pixels = pixels, .answers = 2 * reach + 1, .depth_known = s->depth_known != 0.0,
                   .u = all->u + line * profiles, .base = all->base + line * profiles,
                   .colors = all->colors + 3 * line * profiles * pixels,
                   .hidden = all->hidden + line * profiles * pixels, .preference = preference};
}

/* Colours on both sides of the fitted rows, and their mean step over the supporting profiles. */
static void look_aside(const Strip *strip, const double *row, const uint8_t *support, Fit *fit) {
    double steps[3] = {0.0, 0.0, 0.0};
    for (int k = 0; k < strip->profiles; k++) {
        if (!support[k]) continue;
        double index = fmin(fmax(rint(row[k] - strip->base[k]), -strip->reach), strip->reach);
        const uint8_t *color = strip->colors + 3 * (k * strip->pixels + strip->reach + strip->side + (int)index);
        for (int c = 0; c < 3; c++) steps[c] += (double)color[3 * strip->side + c] - color[-3 * strip->side + c];
    }
    for (int c = 0; c < 3; c++) fit->step[c] = steps[c] / fmax(fit->count, 1.0);
}

/* Colours before and behind the fitted line itself, (K, 3) each. */
static void copy_sides(const Strip *strip, const Fit *fit, uint8_t *before, uint8_t *behind) {
    double at_zero = fit->level - fit->slope * fit->center;
    for (int k = 0; k < strip->profiles; k++) {
        double row = at_zero + fit->slope * strip->u[k];
        double index = fmin(fmax(rint(row - strip->base[k]), -strip->reach), strip->reach);
        const uint8_t *color = strip->colors + 3 * (k * strip->pixels + strip->reach + strip->side + (int)index);
        memcpy(before + 3 * k, color - 3 * strip->side, 3);
        memcpy(behind + 3 * k, color + 3 * strip->side, 3);
    }
}

/* Fit all lines; u, support and visible are (lines, profiles), sides (2, lines, profiles, 3) or NULL. 0 if out of
   memory. */
int fit_lines(const Scene *scene, const Setting *s, const Query *queries, Fit *fits, double *u, uint8_t *support,
              uint8_t *visible, uint8_t *sides) {
    int lines = (int)s->lines, profiles = (int)s->profiles, reach = (int)s->reach, answers = 2 * reach + 1;
    long points = (long)lines * profiles, pixels = 2 * (reach + (int)s->side) + 1;
    long doubles = 4 * points + 3 * profiles, floats = (long)profiles * answers + 2 * answers + 8 + 4 * profiles;
    double *memory = malloc(doubles * sizeof(double) + floats * sizeof(float) + 4 * points * pixels +
                            (long)profiles * answers + profiles * sizeof(int));
    if (memory == NULL) return 0;
    Lines all = {.u = u, .base = memory, .predicted = memory + points, .row = memory + 2 * points,
                 .distance = memory + 3 * points, .visible = visible, .good = support};
    double *scratch = memory + 4 * points;
    float *answer = (float *)(scratch + 3 * profiles), *preference = answer + (long)profiles * answers + answers + 2;
    float *told = preference + answers + 6;
    int *held = (int *)(told + 4 * profiles);
    all.colors = (uint8_t *)(held + profiles), all.hidden = all.colors + 3 * points * pixels;
    uint8_t *allowed = all.hidden + points * pixels;
    double faint = FAINT_SHARE * s->contrast_min;
    int agreed = 1;
    for (int i = 0; i < answers; i++) {
        double offset = (i - reach) / fmax(PREFERENCE * reach, 1.0);
        preference[i] = (float)exp(-0.5 * (offset * offset));
    }
    for (int line = 0; line < lines; line++) {
        Strip strip = strip_of(scene, queries, s, &all, line, preference);
        const Query *q = queries + line;
        double direction[3] = {q->step[0], q->step[1], q->step[2]};
        uint8_t *good = support + line * profiles, *seen = visible + line * profiles;
        long at = (long)line * profiles;
        gather(&strip, all.predicted + at, seen);
        if (q->known == 0.0) direction_of(&strip, told, scratch, direction);
        double norm = sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
        float unit[3];
        for (int c = 0; c < 3; c++) unit[c] = 0.5f * (float)(direction[c] / fmax(norm, STEP_MIN));
        find_edges(&strip, unit, fmax(STEP_SHARE * norm, faint), faint, seen, answer, allowed, all.row + at, good);
        int alive = shifted(all.row + at, all.predicted + at, good, profiles, s->gate, all.distance + at, scratch);
        agreed = agreed && alive && q->known != 0.0;
        fits[line].alive = norm >= STEP_MIN;
    }
    for (int line = 0; line < lines; line++) {
        Strip strip = strip_of(scene, queries, s, &all, line, preference);
        long at = (long)line * profiles;
        uint8_t *good = support + at, *seen = visible + at;
        double *distance = all.distance + at, *row = all.row + at;
        Fit *fit = fits + line;
        int first, last, count = 0, alive = fit->alive != 0.0;
        /* one line far from its prediction has all of them looked for anew */
        if (!agreed) alive &= consensus(strip.u, row, good, profiles, (float)s->gate, distance, held);
        for (int k = 0; k < profiles; k++) count += good[k];
        alive &= count >= s->min_profiles;
        for (int k = 0; k < profiles; k++) good[k] = alive && good[k] && fabs(distance[k]) < s->gate;
        longest_run(good, seen, profiles, (int)s->bridge, &first, &last);
        fit->count = fit->seen = 0.0;
        for (int k = 0; k < profiles; k++) {
            good[k] = good[k] && k >= first && k <= last;
            fit->count += good[k];
            fit->seen += k >= first && k <= last && (good[k] || seen[k]);
        }
        fit->first = first, fit->last = last;
        tukey_line(strip.u, row, good, profiles, fit, scratch, scratch + profiles);
        look_aside(&strip, row, good, fit);
        double contrast = fit->step[0] * fit->step[0] + fit->step[1] * fit->step[1] + fit->step[2] * fit->step[2];
        fit->alive = alive && fit->count >= s->min_profiles && contrast >= s->contrast_min * s->contrast_min;
        if (sides != NULL) copy_sides(&strip, fit, sides + 3 * at, sides + 3 * (points + at));
    }
    free(memory);
    return 1;
}
