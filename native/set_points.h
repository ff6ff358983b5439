/* Set-points of a motion in joint space, from the numbers of its path and of its profile; see heptarm.planning.table. */
#ifndef HEPTARM_SET_POINTS_H
#define HEPTARM_SET_POINTS_H

#include <stdint.h>

enum { AXES = 7, PIECE = 5, LINE = 2 + 2 * AXES };

/* What `MotionTable` describes. Rows of pieces: a time, and the coefficients of s over the time since; of lines: s at both ends,
   joint positions at the first one and their span. */
struct table {
    const double *pieces, *lines;
    int64_t piece_count, line_count;
    double end;
};

/* Where a motion is: its time, s there, and the piece and the line that they are in. */
struct cursor {
    double time, place;
    int64_t piece, line;
};

/* Put a cursor at a time before all lines; s is not known there. */
void ha_put(const struct table *t, struct cursor *c, double time);

/* Move a cursor on, and give the set-point there. Returns 0 at the end of the profile or of the path, and where an axis cannot
   follow: `leap` is how far it comes from `last` in a tick. */
int64_t ha_next(const struct table *t, struct cursor *c, double step, const double *last, const double *leap, double *there);

#endif
