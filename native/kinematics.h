/* Kinematics of an LBR in C, as in heptarm.model: the tests compare them. Base axes, SI units.

   For the native loop and the ready laws. Jacobian and damped inverse as in Siciliano et al., "Robotics", 2009, chapter 3. */
#ifndef HEPTARM_KINEMATICS_H
#define HEPTARM_KINEMATICS_H

#include <math.h>
#include <string.h>

enum { N = 7 };

static inline void cross(const double *a, const double *b, double *c) {
    double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
    c[0] = x;
    c[1] = y;
}

static inline double dot(const double *a, const double *b, int size) {
    double sum = 0.0;
    for (int i = 0; i < size; i++) sum += a[i] * b[i];
    return sum;
}

static inline void rotate(const double *turn, const double *v, double *into) {
    double x = dot(turn, v, 3), y = dot(turn + 3, v, 3);
    into[2] = dot(turn + 6, v, 3);
    into[0] = x;
    into[1] = y;
}

/* Move a frame, its rotation and its place, from link i - 1 to link i, whose joint is at `origin` in it; the joint's axis. */
static inline void advance(int i, const double *origin, double q, double *turn, double *place, double *axis) {
    static const int direction[N] = {2, 1, 2, 1, 2, 1, 2};
    static const double sign[N] = {1, 1, 1, -1, 1, 1, 1};
    double c = cos(q), s = sin(q) * sign[i], offset[3];
    int d = direction[i], first = d == 2 ? 0 : 2, second = d == 2 ? 1 : 0; /* the columns that turn: x y, or z x */
    rotate(turn, origin, offset);
    for (int k = 0; k < 3; k++) place[k] += offset[k];
    for (int k = 0; k < 3; k++) {
        double u = turn[3 * k + first], v = turn[3 * k + second];
        turn[3 * k + first] = c * u + s * v;
        turn[3 * k + second] = c * v - s * u;
        axis[k] = sign[i] * turn[3 * k + d];
    }
}

/* Jacobian of a point that moves with the flange, base axes. */
static inline void jacobian(const double axis[N][3], const double origin[N][3], const double *point, double j[6][N]) {
    for (int i = 0; i < N; i++) {
        double lever[3], part[3];
        for (int k = 0; k < 3; k++) lever[k] = point[k] - origin[i][k];
        cross(axis[i], lever, part);
        for (int k = 0; k < 3; k++) {
            j[k][i] = part[k];
            j[3 + k][i] = axis[i][k];
        }
    }
}

/* Cholesky factor of a symmetric positive definite matrix, in place; 0 if it is not. */
static inline int factorise(double *m, int size) {
    for (int i = 0; i < size; i++)
        for (int j = 0; j <= i; j++) {
            double sum = m[size * i + j] - dot(m + size * i, m + size * j, j);
            if (i != j) {
                m[size * i + j] = sum / m[size * j + j];
            } else {
                if (!(sum > 0.0)) return 0;
                m[size * i + i] = sqrt(sum);
            }
        }
    return 1;
}

static inline void solve(const double *factor, int size, double *b) {
    for (int i = 0; i < size; i++) b[i] = (b[i] - dot(factor + size * i, b, i)) / factor[size * i + i];
    for (int i = size - 1; i >= 0; i--) {
        for (int j = i + 1; j < size; j++) b[i] -= factor[size * j + i] * b[j];
        b[i] /= factor[size * i + i];
    }
}

/* J J' + DAMPING 1 of a Jacobian, factorised: damped inverses near singular postures; 0 if it is not positive definite. */
#define DAMPING 1e-4
static inline int damped_square(const double j[6][N], double *square) {
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++) square[6 * r + c] = dot(j[r], j[c], N) + (r == c ? DAMPING : 0.0);
    return factorise(square, 6);
}

/* Constants of a robot's kinematics: origin of each joint in the link before it, flange in the last link [m]. */
struct chain {
    double origin[N][3], flange[3];
};

/* What gives the wrench on the flange by the torques of the joints in a posture: the damped inverse of the transposed
   Jacobian, base axes. */
struct wrench_map {
    double q[N], inverse[6][N];
};

/* 0 if the damped square is not positive definite. */
static inline int map_wrenches(const struct chain *chain, const double *q, struct wrench_map *map) {
    double turn[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, place[3] = {0, 0, 0}, offset[3], axis[N][3], origin[N][3];
    double j[6][N], factor[36], column[6];
    memcpy(map->q, q, sizeof map->q);
    for (int i = 0; i < N; i++) {
        advance(i, chain->origin[i], q[i], turn, place, axis[i]);
        memcpy(origin[i], place, sizeof place);
    }
    rotate(turn, chain->flange, offset);
    for (int k = 0; k < 3; k++) place[k] += offset[k];
    jacobian(axis, origin, place, j);
    if (!damped_square(j, factor)) return 0;
    for (int i = 0; i < N; i++) {
        for (int r = 0; r < 6; r++) column[r] = j[r][i];
        solve(factor, 6, column);
        for (int r = 0; r < 6; r++) map->inverse[r][i] = column[r];
    }
    return 1;
}

/* External wrench on the flange, base axes [N, Nm], that explains external torques of the joints best (least squares). */
static inline void explain_torques(const struct wrench_map *map, const double *tau, double *wrench) {
    for (int r = 0; r < 6; r++) wrench[r] = dot(map->inverse[r], tau, N);
}

#endif
