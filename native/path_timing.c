/* How fast a path may be followed: the inner loops of heptarm.planning.time_scaling, which says what they are for. */
#include <math.h>
#include <stdint.h>

/* Limits of ds/dt and its derivatives, see PathConstraints there: `count` samples of `axes` coordinates each. */
struct limits {
    const double *s, *steepest, *first, *second, *third, *fastest, *velocity, *acceleration, *jerk;
    int64_t count, axes;
};

/* The least of values within a reach to both sides of each sample of s. */
void hp_least_around(int64_t count, const double *s, const double *values, const double *reaches, double *result) {
    for (int64_t n = 0; n < count; n++) result[n] = values[n];
    for (int64_t n = 0; n < count; n++) {
        for (int64_t k = n; k >= 0 && s[k] >= s[n] - reaches[n]; k--)
            if (values[n] < result[k]) result[k] = values[n];
        for (int64_t k = n + 1; k < count && s[k] < s[n] + reaches[n]; k++)
            if (values[n] < result[k]) result[k] = values[n];
    }
}

/* The largest acceleration of s at a sample, where its square of speed is x: the least of free - taken * x. */
static double pull(int64_t axes, const double *free, const double *taken, double x) {
    double least = INFINITY;
    for (int64_t i = 0; i < axes; i++) {
        double one = free[i] - taken[i] * x;
        if (one < least) least = one;
    }
    return least;
}

/* Lower the square of speed at a sample to what its acceleration from the neighbour before allows, of which `least` is always free. */
static void follow(int64_t axes, const double *free, const double *taken, int64_t from, int64_t to, double gap, double least, double *square) {
    double now = square[from];
    if (now >= square[to]) return;
    double more = pull(axes, free + axes * from, taken + axes * from, now), there = pull(axes, free + axes * to, taken + axes * to, now);
    if (there < more) more = there;
    if (least > more) more = least;
    if (now + 2.0 * gap * more < square[to]) square[to] = now + 2.0 * gap * more;
}

/* Lower squares of speeds to what accelerations allow, forwards and backwards (Bobrow 1985). At least the fraction `least` of what is
   free accelerates. */
void hp_reachable(int64_t count, int64_t axes, const double *s, const double *free, const double *taken, double least, double *square) {
    for (int64_t n = 0; n + 1 < count; n++)
        follow(axes, free, taken, n, n + 1, s[n + 1] - s[n], least * pull(axes, free + axes * n, taken, 0.0), square);
    for (int64_t n = count - 1; n > 0; n--)
        follow(axes, free, taken, n, n - 1, s[n] - s[n - 1], least * pull(axes, free + axes * n, taken, 0.0), square);
}

/* Factors by which a motion exceeds the limits, at the samples of the path: of velocity, acceleration and jerk, `count` numbers each,
   which are 0 before. places, v, a, j: s and its derivatives at times, s ascending. */
void hp_excess(const struct limits *p, int64_t times, const double *places, const double *v, const double *a, const double *j, double *found) {
    int64_t at = 0, low = 0, m = p->axes;
    for (int64_t t = 0; t < times; t++) {
        while (at < p->count - 1 && p->s[at] < places[t]) at++;
        while (low < p->count - 2 && p->s[low + 1] <= places[t]) low++;
        double width = p->s[low + 1] - p->s[low], part = width > 0.0 ? (places[t] - p->s[low]) / width : 0.0;
        double most[3] = {v[t] / p->fastest[at], 0.0, 0.0};
        part = part < 0.0 ? 0.0 : part > 1.0 ? 1.0 : part;
        for (int64_t i = 0; i < m; i++) {
            int64_t x = m * low + i, y = x + m, here = m * at + i;
            double steepest = p->steepest[x] + part * (p->steepest[y] - p->steepest[x]);
            double first = p->first[x] + part * (p->first[y] - p->first[x]);
            double second = p->second[x] + part * (p->second[y] - p->second[x]);
            double third = p->third[x] + part * (p->third[y] - p->third[x]);
            const double each[3] = {
                steepest * v[t] / p->velocity[here],
                fabs(first * a[t] + second * v[t] * v[t]) / p->acceleration[here],
                fabs(first * j[t] + 3.0 * second * v[t] * a[t] + third * v[t] * v[t] * v[t]) / p->jerk[here],
            };
            for (int k = 0; k < 3; k++)
                if (each[k] > most[k]) most[k] = each[k];
        }
        for (int k = 0; k < 3; k++)
            if (most[k] > found[k * p->count + at]) found[k * p->count + at] = most[k];
    }
}
