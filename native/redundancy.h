/* Redundancy and inverse kinematics of an LBR: E1 (the angle of A3), Status, arm angle; see redundancy.c. */
#ifndef HEPTARM_REDUNDANCY_H
#define HEPTARM_REDUNDANCY_H

#include "kinematics.h"

/* Constants of a robot: its chain along z, the distances in it, limits of its joints. */
struct arm {
    struct chain chain;
    double d_bs, d_se, d_ew, d_wf, q_min[N], q_max[N];
};

/* What is asked of the inverse kinematics beside the pose. */
struct request {
    double a3;         /* tried for A3 [rad]; NaN: that of `near` */
    int is_fixed;      /* A3 has this value, or there is no solution */
    int status;        /* bits 0-2; -1: that of near, if possible */
    int is_unlimited;  /* joints may be beyond their limits */
    const double *near; /* NULL: a usual posture */
};

enum { FOUND = 1, TOO_FAR = 0, NO_POSTURE = -1 };

int hi_status(const struct arm *arm, const double *q);
double hi_arm_angle(const struct arm *arm, const double *q);
void hk_forward(const struct arm *arm, long count, const double *q, double *poses);
void hk_jacobian(const struct arm *arm, long count, const double *q, const double *point, double *jacobians);
void hi_solve(const struct arm *arm, long count, const double *poses, const double *a3, const int *status, const double *near, int is_fixed,
              double *q, int *outcome);
int find_joints(const struct arm *arm, const double *turn, const double *place, const struct request *request, double *q);

#endif
