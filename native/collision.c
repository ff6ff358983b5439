/* Distances of shapes at joint positions, of the nearest two at many postures, and how far the arm may move on from there.
   heptarm.sim.distances says which pairs of shapes count.

   Each shape has a box with rounded edges around it, whose distance from another one is cheap to bound from below. Only for pairs
   that this leaves within reach the distance is computed, by MuJoCo, whose functions are called through pointers: exact for every
   shape that it knows. */
#include <stddef.h>
#include <stdint.h>

#include "kinematics.h"

/* Around a shape, or around several of one body, in the frame of the shape `frame`: a box of half edges `half` and centre
   `middle`, extended by `radius` on all sides; and `reach`, of a sphere around the origin of that frame. A plane has neither. [m] */
struct hull {
    double half[3], middle[3], radius, reach;
    int64_t frame, is_plane;
};

/* A hull of the arm, its tool or what it holds, and one that it may meet. `size` is 1 for two shapes; else the second hull is around
   those of the next entries, of which there are `size` less this one: a tree, in the order of a walk through it. */
struct entry {
    int32_t first, second, size;
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
    const struct entry *entries;
    int64_t count, all;                     /* of entries: of those that may not touch; with those that may */
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

static void centre(const struct checks *c, const struct hull *hull, double *at) {
    rotate(c->turns + 9 * hull->frame, hull->middle, at);
    for (int k = 0; k < 3; k++) at[k] += c->places[3 * hull->frame + k];
}

/* Lower bound of the distance of a hull above a plane. */
static double above(const struct checks *c, const struct hull *plane, const struct hull *hull) {
    const double *turn = c->turns + 9 * hull->frame, *base = c->turns + 9 * plane->frame;
    const double normal[3] = {base[2], base[5], base[8]};
    double at[3], result = -hull->radius;
    centre(c, hull, at);
    for (int k = 0; k < 3; k++) {
        double along = normal[0] * turn[k] + normal[1] * turn[3 + k] + normal[2] * turn[6 + k];
        result += normal[k] * (at[k] - c->places[3 * plane->frame + k]) - hull->half[k] * fabs(along);
    }
    return result;
}

/* Lower bound of the distance of two hulls: of their boxes along the axes of either, whose gaps are at right angles. */
static double apart(const struct checks *c, const struct hull *a, const struct hull *b) {
    const double *ra = c->turns + 9 * a->frame, *rb = c->turns + 9 * b->frame;
    double at[3], there[3], turn[3][3], squares[2] = {0.0, 0.0};
    centre(c, a, at);
    centre(c, b, there);
    for (int k = 0; k < 3; k++) there[k] -= at[k];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) turn[i][j] = fabs(ra[i] * rb[j] + ra[3 + i] * rb[3 + j] + ra[6 + i] * rb[6 + j]);
    for (int i = 0; i < 3; i++) {
        double of_a = fabs(ra[i] * there[0] + ra[3 + i] * there[1] + ra[6 + i] * there[2]) - a->half[i];
        double of_b = fabs(rb[i] * there[0] + rb[3 + i] * there[1] + rb[6 + i] * there[2]) - b->half[i];
        for (int j = 0; j < 3; j++) of_a -= turn[i][j] * b->half[j], of_b -= turn[j][i] * a->half[j];
        if (of_a > 0.0) squares[0] += of_a * of_a;
        if (of_b > 0.0) squares[1] += of_b * of_b;
    }
    double gap = fmax(squares[0], squares[1]); /* without one nothing is known of the depth */
    return gap > 0.0 ? sqrt(gap) - a->radius - b->radius : -INFINITY;
}

/* Whether two hulls are surely farther apart than a distance. */
static int is_beyond(const struct checks *c, const struct hull *a, const struct hull *b, double distance) {
    double most = distance + TOLERANCE, reach = a->reach + b->reach + most, square = 0.0;
    if (b->is_plane) return above(c, b, a) > most;
    if (a->is_plane) return above(c, a, b) > most;
    for (int k = 0; k < 3; k++) {
        double gap = c->places[3 * a->frame + k] - c->places[3 * b->frame + k];
        square += gap * gap;
    }
    return (reach > 0.0 && square > reach * reach) || apart(c, a, b) > most;
}

/* The next pair of shapes from an entry on that may be nearer than a distance; `end`: there is none. */
static int64_t next_near(const struct checks *c, int64_t n, int64_t end, double distance) {
    while (n < end) {
        const struct entry *entry = c->entries + n;
        if (is_beyond(c, c->hulls + entry->first, c->hulls + entry->second, distance))
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

/* Move on along a straight joint path until bodies are nearer than a margin, or to its end (conservative advancement, Mirtich
   1996); the count of checks.

   moved: bound on the movement of all points on the whole path. least: what they may move beyond the distance. far: to look no
   farther than this. single: move by one step only. at, distance: where it is on the path, 0 to 1, and the distance there, before
   and after. */
int64_t hc_advance(const struct checks *c, const double *first, const double *change, double moved, double margin, double least,
                   double far, int single, double *at, double *distance) {
    int64_t checks = 0;
    double q[N];
    do {
        double look = fmin(fmax((1.0 - *at) * moved, margin), far);
        *at = fmin(1.0, *at + (fmin(fmax(*distance, margin), look) + least) / moved);
        for (int i = 0; i < N; i++) q[i] = first[i] + *at * change[i];
        *distance = nearest(c, q, fmin(fmax((1.0 - *at) * moved, margin), far));
        checks++;
    } while (*at < 1.0 && *distance >= margin && !single);
    return checks;
}
