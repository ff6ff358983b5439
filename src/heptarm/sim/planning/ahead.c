/* Set-points of a motion, many at once: what `SetPointRows` computes in Python, which is the reference. */
#include <math.h>
#include <stdint.h>

enum { AXES = 7, PIECE = 5, LINE = 2 + 2 * AXES };

/* What `MotionTable` describes. Rows of pieces: a time, and the coefficients of s over the time since; of lines: s at both ends,
   joint positions at the first one and their span. */
struct table {
    const double *pieces, *lines;
    int64_t piece_count, line_count;
    double end;
};

/* The last set-point and how far an axis can follow in a tick; what is computed. */
struct ahead {
    const double *last, *leap;
    double *times, *places, *joints;
    int64_t most;
};

/* Fills in the ticks after a time and returns how many they are: at most `most`, none at the end of the profile or of the path,
   and none from the first on that leaps further than an axis can follow. */
int64_t ha_ahead(const struct table *t, const struct ahead *a, double time, double step) {
    int64_t low = 0, high = t->piece_count - 1, count = 0;
    while (low < high) { /* the last piece that begins before the first tick */
        int64_t middle = (low + high + 1) / 2;
        if (t->pieces[middle * PIECE] <= time) low = middle;
        else high = middle - 1;
    }
    const double *piece = t->pieces + low * PIECE, *line = t->lines, *last = a->last;
    int64_t pieces_left = t->piece_count - 1 - low, lines_left = t->line_count - 1;
    for (; count < a->most; count++) {
        time += step;
        if (time >= t->end) break;
        while (pieces_left && time >= piece[PIECE]) piece += PIECE, pieces_left--;
        double since = time - piece[0], s = piece[1] + since * (piece[2] + since * (piece[3] + since * piece[4]));
        if (s < 0.0) s = 0.0;
        if (s >= 1.0) break;
        while (lines_left && s >= line[LINE]) line += LINE, lines_left--;
        double part = (s - line[0]) / (line[1] - line[0]), *there = a->joints + count * AXES;
        if (part > 1.0) part = 1.0;
        for (int i = 0; i < AXES; i++) {
            there[i] = line[2 + i] + part * line[2 + AXES + i];
            if (fabs(there[i] - last[i]) > a->leap[i]) return count;
        }
        a->times[count] = time, a->places[count] = s, last = there;
    }
    return count;
}
