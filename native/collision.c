/* Distances of shapes at joint positions, of the nearest two at many postures, and how far the arm may move on from there.
   heptarm.sim.distances says which pairs of shapes count.

   Each shape has a box with rounded edges around it, whose distance from another one is cheap to bound from below. Only for pairs
   that this leaves within reach the distance is computed, by MuJoCo, whose functions are called through pointers: exact for every
   shape that it knows. */
#include <stddef.h>
#include <stdint.h>

#include "kinematics.h"

/* Around a shape, or around several of one body, in the frame of the shape `frame`: a box of half edges `half` and centre
   `middle`, extended by `radius` on all sides; and `reach`, of a sphere around that centre. A plane has neither. [m] */
struct hull {
    double half[3], middle[3], radius, reach;
    int64_t frame, is_plane;
};

/* A hull of the arm, its tool or what it holds, and one that it may meet. `size` is 1 for two shapes; else the second hull is around
   those of the next entries, of which there are `size` less this one: a tree, in the order of a walk through it. `lever`: number of
   their levers. */
struct entry {
    int32_t first, second, size, lever;
};

/* A body that the flange carries: where its position is in MuJoCo's, and its pose in the flange: place, quaternion x y z w. */
struct grip {
    int64_t address;
    double place[3], quat[4];
};

/* A model to check, see heptarm.sim.distances. */
struct checks {
    const void *model;
    void *data;
    void (*kinematics)(const void *model, void *data);
    double (*distance)(const void *model, void *data, int first, int second, double most, double *segment);
    double *positions;                      /* of all joints, in MuJoCo's data */
    const double *places, *turns;           /* of the shapes, likewise */
    const double *flange_place, *flange_turn;
    const struct hull *hulls;               /* of the shapes, then those around several */
    double *centres;                        /* of the hulls in the present posture, 3 numbers each */
    int64_t shells;                         /* count of hulls */
    const struct entry *entries;
    int64_t count, all;                     /* of entries: of those that may not touch; with those that may */
    const double *levers;                   /* how far two hulls move to each other for each radian of the joints, N numbers each */
    double *moves;                          /* by how much they may, on a path: as many as there are levers */
    int64_t levels;                         /* count of levers */
    double *rooms;                          /* by how much two hulls may still move before they are looked at again, of each entry */
    const struct grip *grips;
    int64_t held;                           /* count of grips */
};

/* MuJoCo computes distances to a tolerance of this [m]. */
static const double TOLERANCE = 1e-6;

int64_t hc_size(void) { return sizeof(struct checks); }

/* Let the flange carry what it holds. */
static void carry(const struct checks *c) {
    double f[4], offset[3];
    quaternion(c->flange_turn, f);
    for (int64_t n = 0; n < c->held; n++) {
        const struct grip *grip = c->grips + n;
        const double *g = grip->quat;
        double *to = c->positions + grip->address;
        rotate(c->flange_turn, grip->place, offset);
        for (int k = 0; k < 3; k++) to[k] = c->flange_place[k] + offset[k];
        to[3] = f[3] * g[3] - f[0] * g[0] - f[1] * g[1] - f[2] * g[2]; /* MuJoCo's are w x y z */
        to[4] = f[3] * g[0] + f[0] * g[3] + f[1] * g[2] - f[2] * g[1];
        to[5] = f[3] * g[1] - f[0] * g[2] + f[1] * g[3] + f[2] * g[0];
        to[6] = f[3] * g[2] + f[0] * g[1] - f[1] * g[0] + f[2] * g[3];
    }
    c->kinematics(c->model, c->data);
}

/* Lower bound of the distance of a hull above a plane. */
static double above(const struct checks *c, int32_t plane, int32_t other) {
    const struct hull *hull = c->hulls + other;
    const double *turn = c->turns + 9 * hull->frame, *base = c->turns + 9 * c->hulls[plane].frame;
    const double *at = c->centres + 3 * other, *origin = c->places + 3 * c->hulls[plane].frame;
    const double normal[3] = {base[2], base[5], base[8]};
    double result = -hull->radius;
    for (int k = 0; k < 3; k++) {
        double along = normal[0] * turn[k] + normal[1] * turn[3 + k] + normal[2] * turn[6 + k];
        result += normal[k] * (at[k] - origin[k]) - hull->half[k] * fabs(along);
    }
    return result;
}

/* Sum of the squares of what is positive. */
static double beyond(const double *gaps) {
    double sum = 0.0;
    for (int k = 0; k < 3; k++)
        if (gaps[k] > 0.0) sum += gaps[k] * gaps[k];
    return sum;
}

/* Lower bound of the distance of two hulls, which is looked for until it is more than `enough`: of the spheres around them, of that
   around the first one and the box of the second one, and of both boxes along the axes of either, whose gaps are at right angles. */
static double apart(const struct checks *c, int32_t first, int32_t second, double enough) {
    const struct hull *a = c->hulls + first, *b = c->hulls + second;
    if (b->is_plane) return above(c, second, first);
    if (a->is_plane) return above(c, first, second);
    const double *ra = c->turns + 9 * a->frame, *rb = c->turns + 9 * b->frame;
    const double *from = c->centres + 3 * first, *to = c->centres + 3 * second;
    const double there[3] = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
    double reach = a->reach + b->reach + enough;
    double square = there[0] * there[0] + there[1] * there[1] + there[2] * there[2];
    if (reach < 0.0 || square > reach * reach) return sqrt(square) - a->reach - b->reach;
    double along_a[3], along_b[3], turn[3][3];
    for (int j = 0; j < 3; j++) along_b[j] = fabs(rb[j] * there[0] + rb[3 + j] * there[1] + rb[6 + j] * there[2]) - b->half[j];
    double ball = beyond(along_b), bound = ball > 0.0 ? sqrt(ball) - b->radius - a->reach : -INFINITY;
    if (bound > enough) return bound;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) turn[i][j] = fabs(ra[i] * rb[j] + ra[3 + i] * rb[3 + j] + ra[6 + i] * rb[6 + j]);
    for (int i = 0; i < 3; i++) {
        along_a[i] = fabs(ra[i] * there[0] + ra[3 + i] * there[1] + ra[6 + i] * there[2]) - a->half[i];
        for (int j = 0; j < 3; j++) along_a[i] -= turn[i][j] * b->half[j], along_b[i] -= turn[j][i] * a->half[j];
    }
    double of_a = beyond(along_a), of_b = beyond(along_b), most = of_a > of_b ? of_a : of_b;
    double boxes = most > 0.0 ? sqrt(most) - a->radius - b->radius : -INFINITY; /* without a gap nothing is known of the depth */
    return boxes > bound ? boxes : bound;
}

/* Whether two hulls are surely farther apart than a distance. */
static int is_beyond(const struct checks *c, const struct entry *pair, double distance) {
    return apart(c, pair->first, pair->second, distance + TOLERANCE) > distance + TOLERANCE;
}

/* The next pair of shapes from an entry on that may be nearer than a distance; `end`: there is none. */
static int64_t next_near(const struct checks *c, int64_t n, int64_t end, double distance) {
    while (n < end) {
        const struct entry *entry = c->entries + n;
        if (is_beyond(c, entry, distance))
            n += entry->size;
        else if (entry->size == 1)
            return n;
        else
            n++;
    }
    return end;
}

/* Distance of a pair of shapes; at least `most`: they are farther apart than that, which is not negative. */
static double between(const struct checks *c, int64_t n, double most) {
    return c->distance(c->model, c->data, c->entries[n].first, c->entries[n].second, most, NULL);
}

/* Let the arm be at joint positions. */
static void move(const struct checks *c, const double *q) {
    memcpy(c->positions, q, N * sizeof *q);
    c->kinematics(c->model, c->data);
    if (c->held) carry(c);
    for (int64_t n = 0; n < c->shells; n++) {
        const struct hull *hull = c->hulls + n;
        double *at = c->centres + 3 * n;
        rotate(c->turns + 9 * hull->frame, hull->middle, at);
        for (int k = 0; k < 3; k++) at[k] += c->places[3 * hull->frame + k];
    }
}

/* Distance of the nearest two bodies in a posture; infinite: none are nearer than `below`. */
static double nearest(const struct checks *c, const double *q, double below) {
    double best = below;
    move(c, q);
    for (int64_t n = 0; (n = next_near(c, n, c->count, best)) < c->count; n++)
        best = fmin(best, between(c, n, fmax(best, 0.0)));
    return best < below ? best : INFINITY;
}

/* Pairs of shapes that are nearer than `below` in a posture, two numbers each, and their distances; their count. */
int64_t hc_pairs(const struct checks *c, const double *q, double below, int32_t *shapes, double *distances) {
    int64_t found = 0;
    move(c, q);
    for (int64_t n = 0; (n = next_near(c, n, c->all, below)) < c->all; n++) {
        distances[found] = between(c, n, fmax(below, 0.0));
        if (distances[found] >= below) continue;
        shapes[2 * found] = c->entries[n].first, shapes[2 * found + 1] = c->entries[n].second;
        found++;
    }
    return found;
}

/* Distances of the nearest two bodies in many postures. */
void hc_nearest(const struct checks *c, int64_t count, const double *q, double below, double *distances) {
    for (int64_t n = 0; n < count; n++) distances[n] = nearest(c, q + N * n, below);
}

/* How far the arm may move on from a posture, as a fraction of the piece of its path: until two bodies have moved to each other by the
   distance between them and `least`; negative: two bodies are nearer than `margin`. No more than `most`.

   Two hulls are looked at only when they have moved so far since they were looked at last: `rooms` has what is left of it. So are those
   that are near and would make the step shorter; and at a point of the path, `is_point`, those that may be nearer than the margin.
   far: two bodies are near below this; exact distances are computed of these only. */
static double ahead(const struct checks *c, const double *q, double margin, double least, double far, double most, int is_point) {
    double used = is_point ? margin + least : TOLERANCE;
    move(c, q);
    for (int64_t n = 0; n < c->count;) {
        const struct entry *entry = c->entries + n;
        double moved = c->moves[entry->lever];
        if (c->rooms[n] <= used || (c->rooms[n] < far && c->rooms[n] < most * moved)) {
            double enough = most * moved - least;
            if (enough > far) enough = far;
            if (enough < margin) enough = margin;
            double distance = apart(c, entry->first, entry->second, enough + TOLERANCE) - TOLERANCE;
            if (distance <= enough) {
                if (entry->size > 1) {
                    n++;
                    continue;
                }
                distance = between(c, n, enough);
                if (distance < margin) return -1.0;
            }
            c->rooms[n] = distance + least;
        }
        if (c->rooms[n] < most * moved) most = c->rooms[n] / moved;
        n += entry->size;
    }
    return most;
}

/* The first place on a joint path at which bodies are nearer than a margin, by conservative advancement (Mirtich 1996).

   count, points: of the path, which is straight from one to the next. least: what two bodies may move beyond their distance before they
   are looked at again. far: see `ahead`. place: the fraction of the piece between two points, and the joint positions there. checks: of
   postures, to which those done here are added. Returns the piece, or -1: there is none. */
int64_t hc_first(const struct checks *c, int64_t count, const double *points, double margin, double least, double far, double *place,
                 int64_t *checks) {
    double *at = place, *q = place + 1;
    for (int64_t n = 0; n < c->count; n++) c->rooms[n] = 0.0;
    for (int64_t piece = 0; piece + 1 < count; piece++) {
        const double *first = points + N * piece;
        double change[N], end = 0.0;
        for (int i = 0; i < N; i++) change[i] = first[N + i] - first[i];
        for (int64_t n = 0; n < c->levels; n++) {
            c->moves[n] = 0.0;
            for (int i = 0; i < N; i++) c->moves[n] += c->levers[N * n + i] * fabs(change[i]);
        }
        for (*at = 0.0; *at < 1.0 || piece + 2 == count; *at = end) { /* the end is the beginning of the next piece */
            int is_point = *at == 0.0 || *at >= 1.0;
            for (int i = 0; i < N; i++) q[i] = *at < 1.0 ? first[i] + *at * change[i] : first[N + i];
            double step = ahead(c, q, margin, least, far, 1.0 - *at, is_point);
            ++*checks;
            if (step < 0.0) return piece;
            if (*at >= 1.0) break;
            end = *at + step < 1.0 ? *at + step : 1.0;
            for (int64_t n = 0; n < c->count; n++) c->rooms[n] -= (end - *at) * c->moves[c->entries[n].lever];
        }
    }
    return -1;
}

/* Whether bodies are nearer than a margin in a posture. */
static int is_touching(const struct checks *c, const double *q, double margin) {
    move(c, q);
    for (int64_t n = 0; (n = next_near(c, n, c->count, margin)) < c->count; n++)
        if (between(c, n, fmax(margin, 0.0)) < margin) return 1;
    return 0;
}

/* Whether there is no such place as `hc_first` finds, on a path that is straight from first to last: 1, or 0; negative: bodies touch at
   its beginning. Most often they are in the way at its end or in its middle, so these are tried before anything is proven. */
int hc_is_free(const struct checks *c, const double *points, double margin, double least, double far, int64_t *checks) {
    static const double tried[] = {1.0, 0.5, 0.25, 0.75};
    double q[N], place[1 + N];
    int is_free = 1;
    for (size_t n = 0; is_free && n < sizeof tried / sizeof *tried; n++) {
        for (int i = 0; i < N; i++) q[i] = points[i] + tried[n] * (points[N + i] - points[i]);
        is_free = !is_touching(c, q, margin);
        ++*checks;
    }
    if (is_free && hc_first(c, 2, points, margin, least, far, place, checks) < 0) return 1;
    ++*checks;
    return -is_touching(c, points, margin);
}
