/* Set-points of a motion, many at once: what `MotionTable.ahead` computes in Python, which is the reference. */
#include <math.h>

enum { AXES = 7, PIECE = 5, LINE = 2 + 2 * AXES };

/* Fills in times, places and joints of the ticks after a time, and returns how many they are: at most `most`, none at the end
   of the profile or of the path, and none from the first on that leaps further than an axis can follow.

   pieces: rows of a time and of the coefficients of s over the time since; lines: rows of s at both ends, of joint positions at
   the first one and of their span. */
int ha_ahead(const double *pieces, int piece_count, const double *lines, int line_count, double end, double time, double step,
             int most, const double *leap, const double *last, double *times, double *places, double *joints) {
    int low = 0, high = piece_count - 1, count = 0;
    while (low < high) { /* the last piece that begins before the first tick */
        int middle = (low + high + 1) / 2;
        if (pieces[middle * PIECE] <= time) low = middle;
        else high = middle - 1;
    }
    const double *piece = pieces + low * PIECE, *line = lines;
    int left = piece_count - 1 - low, lines_left = line_count - 1;
    for (; count < most; count++) {
        time += step;
        if (time >= end) break;
        while (left && time >= piece[PIECE]) piece += PIECE, left--;
        double t = time - piece[0], s = piece[1] + t * (piece[2] + t * (piece[3] + t * piece[4]));
        if (s < 0.0) s = 0.0;
        if (s >= 1.0) break;
        while (lines_left && s >= line[LINE]) line += LINE, lines_left--;
        double part = (s - line[0]) / (line[1] - line[0]), *there = joints + count * AXES;
        if (part > 1.0) part = 1.0;
        for (int i = 0; i < AXES; i++) {
            there[i] = line[2 + i] + part * line[2 + AXES + i];
            if (fabs(there[i] - last[i]) > leap[i]) return count;
        }
        times[count] = time, places[count] = s, last = there;
    }
    return count;
}
