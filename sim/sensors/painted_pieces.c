/* What of every painted edge a camera sees: `PaintedPieces` of painted_pieces.py, which says what this computes. */

#include <math.h>

enum { COUNT, LEFT, LOW, RIGHT, HIGH, NUMBERS };

/* Whether the point (along, up) of the board is in the picture and not behind arm or brush. */
static int is_seen(const double *view, const double *camera, const unsigned char *hidden, long columns, double along,
                   double up)
{
    const double *corner = view, *per_along = view + 3, *per_up = view + 6;
    const double x = corner[0] + (along * per_along[0] + up * per_up[0]);
    const double y = corner[1] + (along * per_along[1] + up * per_up[1]);
    const double z = corner[2] + (along * per_along[2] + up * per_up[2]);
    if (!(z > camera[6]))
        return 0;
    const double u = x * camera[0] / z + camera[2], v = y * camera[1] / z + camera[3];
    if (!(u >= 0.0 && u <= camera[4] && v >= 0.0 && v <= camera[5]))
        return 0;
    return hidden[(long)rint(v) * columns + (long)rint(u)] == 0;
}

/* The ends of the least-squares line through the points of a piece. */
static void fit(const double *along, const double *up, long count, double *piece)
{
    double middle = 0.0, height = 0.0, above = 0.0, below = 0.0;
    for (long k = 0; k < count; ++k) {
        middle += along[k];
        height += up[k];
    }
    middle /= (double)count;
    height /= (double)count;
    for (long k = 0; k < count; ++k) {
        const double away = along[k] - middle;
        above += away * up[k];
        below += away * away;
    }
    const double slope = above / below;
    piece[LEFT] = along[0];
    piece[RIGHT] = along[count - 1];
    piece[LOW] = height + slope * (along[0] - middle);
    piece[HIGH] = height + slope * (along[count - 1] - middle);
}

/* Of each row the longest run of seen bins between start and end; open and top are (rows, bins), pieces (rows, 5). */
void painted_pieces(const double *view, const double *camera, const unsigned char *hidden, long columns,
                    const unsigned char *open, const double *top, const double *middles, long rows, long bins,
                    long start, long end, double *pieces)
{
    for (long row = 0; row < rows; ++row) {
        const unsigned char *exposed = open + row * bins;
        const double *up = top + row * bins;
        double *piece = pieces + row * NUMBERS;
        long run = 0, longest = 0, first = 0;
        for (long bin = start; bin < end; ++bin) {
            const int seen = exposed[bin] && is_seen(view, camera, hidden, columns, middles[bin], up[bin]);
            run = seen ? run + 1 : 0;
            if (run > longest) {
                longest = run;
                first = bin + 1 - run;
            }
        }
        piece[COUNT] = (double)longest;
        if (longest > 1)
            fit(middles + first, up + first, longest, piece);
    }
}
