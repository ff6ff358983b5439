#include "set_points.h"

#include <math.h>

void ha_put(const struct table *t, struct cursor *c, double time) {
    int64_t low = 0, high = t->piece_count - 1;
    while (low < high) { /* the last piece that begins before it */
        int64_t middle = (low + high + 1) / 2;
        if (t->pieces[middle * PIECE] <= time) low = middle;
        else high = middle - 1;
    }
    c->time = time, c->place = 0.0, c->piece = low, c->line = 0;
}

int64_t ha_next(const struct table *t, struct cursor *c, double step, const double *last, const double *leap, double *there) {
    double time = c->time += step;
    if (time >= t->end) return 0;
    while (c->piece < t->piece_count - 1 && time >= t->pieces[(c->piece + 1) * PIECE]) c->piece++;
    const double *piece = t->pieces + c->piece * PIECE;
    double since = time - piece[0], s = piece[1] + since * (piece[2] + since * (piece[3] + since * piece[4]));
    if (s < 0.0) s = 0.0;
    if (s >= 1.0) return 0;
    while (c->line < t->line_count - 1 && s >= t->lines[(c->line + 1) * LINE]) c->line++;
    const double *line = t->lines + c->line * LINE;
    double part = (s - line[0]) / (line[1] - line[0]);
    if (part > 1.0) part = 1.0;
    c->place = s;
    for (int i = 0; i < AXES; i++) {
        there[i] = line[2 + i] + part * line[2 + AXES + i];
        if (fabs(there[i] - last[i]) > leap[i]) return 0;
    }
    return 1;
}

/* The last set-point and how far an axis can follow in a tick; what is computed. */
struct ahead {
    const double *last, *leap;
    double *times, *places, *joints;
    int64_t most;
};

/* Fills in the ticks after a time, at most `most`, until one has no set-point; returns how many they are. */
int64_t ha_ahead(const struct table *t, const struct ahead *a, double time, double step) {
    struct cursor at;
    const double *last = a->last;
    ha_put(t, &at, time);
    for (int64_t count = 0; count < a->most; count++) {
        double *there = a->joints + count * AXES;
        if (!ha_next(t, &at, step, last, a->leap, there)) return count;
        a->times[count] = at.time, a->places[count] = at.place, last = there;
    }
    return a->most;
}
