/* Kinematics of an LBR: the chain of its joints, its Jacobian, the wrench that explains torques. Base axes, SI units.

   heptarm.model, the paths of the simulator, its tick, the FRI loop and the ready laws share it. Jacobian and damped inverse as in
   Siciliano et al., "Robotics", 2009, chapter 3. */
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

/* Rotation vector from one rotation to another, rows, base axes [rad]. */
static inline void turn_between(const double *from, const double *to, double *vector) {
    double r[9]; /* to from' */
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) r[3 * i + j] = dot(to + 3 * i, from + 3 * j, 3);
    double twice[3] = {r[7] - r[5], r[2] - r[6], r[3] - r[1]}, size = 0.5 * sqrt(dot(twice, twice, 3));
    double angle = atan2(size, 0.5 * (r[0] + r[4] + r[8] - 1.0));
    if (size < 1e-9 && angle > 1.0) { /* half a turn: the axis from the diagonal */
        for (int k = 0; k < 3; k++) vector[k] = angle * sqrt(fmax(0.0, 0.5 * (r[4 * k] + 1.0)));
        return;
    }
    double scale = size < 1e-9 ? 0.5 : 0.5 * angle / size;
    for (int k = 0; k < 3; k++) vector[k] = scale * twice[k];
}

/* Rows of the rotation of a unit quaternion x y z w. */
static inline void rotation(const double *quat, double *r) {
    double x = quat[0], y = quat[1], z = quat[2], w = quat[3];
    r[0] = 1 - 2 * (y * y + z * z), r[1] = 2 * (x * y - w * z), r[2] = 2 * (x * z + w * y);
    r[3] = 2 * (x * y + w * z), r[4] = 1 - 2 * (x * x + z * z), r[5] = 2 * (y * z - w * x);
    r[6] = 2 * (x * z - w * y), r[7] = 2 * (y * z + w * x), r[8] = 1 - 2 * (x * x + y * y);
}

/* Unit quaternion x y z w of a rotation (Shepperd 1978). */
static inline void quaternion(const double *r, double *quat) {
    double trace = r[0] + r[4] + r[8];
    int largest = 3;
    double most = trace;
    for (int k = 0; k < 3; k++)
        if (r[4 * k] > most) most = r[4 * k], largest = k;
    if (largest == 3) {
        double w = 0.5 * sqrt(1.0 + trace), f = 0.25 / w;
        quat[0] = (r[7] - r[5]) * f;
        quat[1] = (r[2] - r[6]) * f;
        quat[2] = (r[3] - r[1]) * f;
        quat[3] = w;
        return;
    }
    int i = largest, j = (i + 1) % 3, k = (i + 2) % 3;
    double u = 0.5 * sqrt(1.0 + r[4 * i] - r[4 * j] - r[4 * k]), f = 0.25 / u;
    quat[i] = u;
    quat[j] = (r[3 * j + i] + r[3 * i + j]) * f;
    quat[k] = (r[3 * k + i] + r[3 * i + k]) * f;
    quat[3] = (r[3 * k + j] - r[3 * j + k]) * f;
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

/* Axes and origins of the joints in a posture, and the frame of the flange: rotation by rows, place [m]. */
struct frames {
    double axis[N][3], origin[N][3], turn[9], place[3];
};

static inline void walk(const struct chain *chain, const double *q, struct frames *f) {
    static const double start[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    double offset[3];
    memcpy(f->turn, start, sizeof start);
    memset(f->place, 0, sizeof f->place);
    for (int i = 0; i < N; i++) {
        advance(i, chain->origin[i], q[i], f->turn, f->place, f->axis[i]);
        memcpy(f->origin[i], f->place, sizeof f->place);
    }
    rotate(f->turn, chain->flange, offset);
    for (int k = 0; k < 3; k++) f->place[k] += offset[k];
}

/* What gives the wrench on the flange by the torques of the joints in a posture: the damped inverse of the transposed
   Jacobian, base axes. */
struct wrench_map {
    double q[N], inverse[6][N];
};

/* 0 if the damped square is not positive definite. */
static inline int map_wrenches(const struct chain *chain, const double *q, struct wrench_map *map) {
    struct frames f;
    double j[6][N], factor[36], column[6];
    memcpy(map->q, q, sizeof map->q);
    walk(chain, q, &f);
    jacobian(f.axis, f.origin, f.place, j);
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
