/* Nearest joint positions of a tree, for the searches of heptarm.planning.search. */
#include <math.h>
#include <stdint.h>

#include "kinematics.h"

/* Index of the nearest of joint positions to a place, and the square of its distance. */
static int64_t nearest(int64_t count, const double *q, const double *place, double *square) {
    int64_t found = 0;
    *square = INFINITY;
    for (int64_t n = 0; n < count; n++) {
        double sum = 0.0;
        for (int i = 0; i < N && sum < *square; i++) sum += (q[N * n + i] - place[i]) * (q[N * n + i] - place[i]);
        if (sum < *square) *square = sum, found = n;
    }
    return found;
}

int64_t hn_nearest(int64_t count, const double *q, const double *place) {
    double square;
    return nearest(count, q, place, &square);
}

/* The first of places that is within the reach of the joint positions nearest to it; -1: none is. */
int64_t hn_within(int64_t count, const double *q, const double *reaches, int64_t tried, const double *places) {
    for (int64_t n = 0; n < tried; n++) {
        double square, reach = reaches[nearest(count, q, places + N * n, &square)];
        if (square <= reach * reach) return n;
    }
    return -1;
}
