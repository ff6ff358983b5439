/* Kinematics and dynamics of an LBR in C, as in heptarm.model: the tests compare them. Base axes, SI units.

   Newton-Euler recursion in base axes (Featherstone, "Rigid Body Dynamics Algorithms", 2008, chapter 5). */
#ifndef HEPTARM_DYNAMICS_H
#define HEPTARM_DYNAMICS_H

#include <math.h>
#include <string.h>

#include "kinematics.h"

enum { BODIES = 8 };

/* Constants of a robot and of the load on its flange, in the order of `heptarm.model.dynamics.rigid_bodies`. */
struct robot {
    double origin[N][3], mass[N], com[N][3], inertia[N][6], flange[3];
    double load_mass, load_com[3], load_inertia[6];
    double rotor; /* inertia that a motor shows behind its gear [kg m2] */
};

struct posture {
    double axis[N][3], origin[N][3];                          /* of the joints */
    double mass[BODIES], com[BODIES][3], inertia[BODIES][9]; /* of the links and the load */
    double turn[9], place[3];                                 /* of the flange */
};

/* R S R' of a symmetric S = xx yy zz xy xz yz. */
static inline void turned(const double *r, const double *s, double *into) {
    double full[9] = {s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2]}, half[9];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) half[3 * i + j] = r[3 * i] * full[j] + r[3 * i + 1] * full[3 + j] + r[3 * i + 2] * full[6 + j];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) into[3 * i + j] = dot(half + 3 * i, r + 3 * j, 3);
}

static inline void find_posture(const struct robot *robot, const double *q, struct posture *p) {
    double turn[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, place[3] = {0, 0, 0}, offset[3];
    for (int i = 0; i < N; i++) {
        advance(i, robot->origin[i], q[i], turn, place, p->axis[i]);
        memcpy(p->origin[i], place, sizeof place);
        rotate(turn, robot->com[i], p->com[i]);
        for (int k = 0; k < 3; k++) p->com[i][k] += place[k];
        p->mass[i] = robot->mass[i];
        turned(turn, robot->inertia[i], p->inertia[i]);
    }
    memcpy(p->turn, turn, sizeof turn);
    rotate(turn, robot->flange, offset);
    for (int k = 0; k < 3; k++) p->place[k] = place[k] + offset[k];
    rotate(turn, robot->load_com, offset);
    for (int k = 0; k < 3; k++) p->com[N][k] = p->place[k] + offset[k];
    p->mass[N] = robot->load_mass;
    turned(turn, robot->load_inertia, p->inertia[N]);
}

/* Force and moment about the joint of a body that moves with it. */
static inline void newton_euler(const struct posture *p, int body, int joint, const double *w, const double *dw, const double *a, double *f, double *n) {
    double lever[3], part[3], force[3], momentum[3];
    for (int k = 0; k < 3; k++) lever[k] = p->com[body][k] - p->origin[joint][k];
    cross(w, lever, part);
    cross(w, part, part);
    cross(dw, lever, force);
    for (int k = 0; k < 3; k++) force[k] = p->mass[body] * (force[k] + part[k] + a[k]);
    rotate(p->inertia[body], w, momentum);
    cross(w, momentum, part);
    rotate(p->inertia[body], dw, momentum);
    for (int k = 0; k < 3; k++) {
        f[k] += force[k];
        n[k] += momentum[k] + part[k];
    }
    cross(lever, force, part);
    for (int k = 0; k < 3; k++) n[k] += part[k];
}

/* Inverse dynamics: M ddq + C dq + g with the acceleration of gravity `fall`. */
static inline void inverse_dynamics(const struct posture *p, const double *dq, const double *ddq, const double *fall, double *tau) {
    double w[N][3], dw[N][3], a[N][3], part[3], lever[3];
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < 3; k++) {
            w[i][k] = i ? w[i - 1][k] : 0.0;
            dw[i][k] = i ? dw[i - 1][k] : 0.0;
            a[i][k] = i ? a[i - 1][k] : -fall[k];
            lever[k] = i ? p->origin[i][k] - p->origin[i - 1][k] : 0.0;
        }
        cross(w[i], lever, part);
        cross(w[i], part, part);
        for (int k = 0; k < 3; k++) a[i][k] += part[k];
        cross(dw[i], lever, part);
        for (int k = 0; k < 3; k++) a[i][k] += part[k];
        cross(w[i], p->axis[i], part);
        for (int k = 0; k < 3; k++) {
            dw[i][k] += part[k] * dq[i] + p->axis[i][k] * ddq[i];
            w[i][k] += p->axis[i][k] * dq[i];
        }
    }
    double f[3] = {0, 0, 0}, n[3] = {0, 0, 0};
    for (int i = N - 1; i >= 0; i--) {
        if (i < N - 1) {
            for (int k = 0; k < 3; k++) lever[k] = p->origin[i + 1][k] - p->origin[i][k];
            cross(lever, f, part);
            for (int k = 0; k < 3; k++) n[k] += part[k];
        } else if (p->mass[N] > 0.0) {
            newton_euler(p, N, i, w[i], dw[i], a[i], f, n);
        }
        newton_euler(p, i, i, w[i], dw[i], a[i], f, n);
        tau[i] = dot(p->axis[i], n, 3);
    }
}

static inline void mass_matrix(const struct posture *p, double m[N][N]) {
    static const double none[N];
    for (int j = 0; j < N; j++) {
        double unit[N] = {0}, column[N];
        unit[j] = 1.0;
        inverse_dynamics(p, none, unit, none, column);
        for (int i = 0; i < N; i++) m[i][j] = column[i];
    }
}

/* With the inertia of the motors: what a torque accelerates. */
static inline void moved_mass(const struct robot *robot, const struct posture *p, double m[N][N]) {
    mass_matrix(p, m);
    for (int i = 0; i < N; i++) m[i][i] += robot->rotor;
}

static inline void coriolis(const struct posture *p, const double *dq, double *tau) {
    static const double none[N];
    inverse_dynamics(p, dq, none, none, tau);
}

static inline void gravity(const struct posture *p, const double *fall, double *tau) {
    static const double none[N];
    inverse_dynamics(p, none, none, fall, tau);
}

/* Rotation vector from a rotation to that of a unit quaternion x y z w, base axes [rad]. */
static inline void rotation_error(const double *turn, const double *quat, double *error) {
    double goal[9];
    rotation(quat, goal);
    turn_between(turn, goal, error);
}

#endif
