/* Forward kinematics and Jacobians of many postures, for heptarm.model and C++. */
#include "redundancy.h"

static void put_pose(const double *turn, const double *place, double *pose) {
    for (int i = 0; i < 3; i++) {
        memcpy(pose + 4 * i, turn + 3 * i, 3 * sizeof *pose);
        pose[4 * i + 3] = place[i];
    }
    pose[12] = pose[13] = pose[14] = 0.0;
    pose[15] = 1.0;
}

/* Homogeneous matrices of the flange. */
void hk_forward(const struct arm *arm, long count, const double *q, double *poses) {
    struct frames f;
    for (long n = 0; n < count; n++) {
        walk(&arm->chain, q + N * n, &f);
        put_pose(f.turn, f.place, poses + 16 * n);
    }
}

/* Homogeneous matrix of the frame of link 1 to 7, at the origin of its joint. */
void hk_link(const struct chain *chain, const double *q, int link, double *pose) {
    double turn[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, place[3] = {0, 0, 0}, axis[3];
    for (int i = 0; i < link; i++) advance(i, chain->origin[i], q[i], turn, place, axis);
    put_pose(turn, place, pose);
}

/* Jacobians, shape (6, 7) each, of a point that moves with the flange; NULL: of the flange. */
void hk_jacobian(const struct arm *arm, long count, const double *q, const double *point, double *jacobians) {
    struct frames f;
    for (long n = 0; n < count; n++) {
        walk(&arm->chain, q + N * n, &f);
        jacobian(f.axis, f.origin, point ? point : f.place, (double(*)[N])(jacobians + 6 * N * n));
    }
}

/* Axes and points of the joints in the base frame, and the flange's position: `struct frames` without its rotation. */
void hk_joints(const struct arm *arm, const double *q, double *axes, double *points, double *tip) {
    struct frames f;
    walk(&arm->chain, q, &f);
    memcpy(axes, f.axis, sizeof f.axis);
    memcpy(points, f.origin, sizeof f.origin);
    memcpy(tip, f.place, sizeof f.place);
}
