/* Steps of a joint with limited velocity, acceleration and jerk, each per step, as in heptarm.fri.guard.joint_guard.

   For the native loop and the ready laws. */
#ifndef HEPTARM_LIMITED_STEPS_H
#define HEPTARM_LIMITED_STEPS_H

#include <math.h>

#include "fri_layout.h"

static inline double least(double a, double b) { return a < b ? a : b; }
static inline double most(double a, double b) { return a > b ? a : b; }

static inline double ramp(double room, double jerk) {
    if (room <= 0.0) return room;
    double n = (double)(word)((sqrt(1.0 + 8.0 * room / jerk) - 1.0) * 0.5);
    return n * jerk + (room - jerk * n * (n + 1) * 0.5) / (n + 1);
}

static inline double brake(double v, double a, double top, double jerk) {
    double target = v > 0.0 ? -ramp(v, jerk) : ramp(-v, jerk);
    return least(least(most(most(target, -top), a - jerk), top), a + jerk);
}

static inline double overrun(double v, double a, double top, double jerk) {
    double peak = v + a * a / (2.0 * jerk), covered, rest;
    if (a >= 0.0)
        covered = (v > 0.0 ? v : 0.0) * a / jerk + a * a * a / (3.0 * jerk * jerk);
    else if (v <= 0.0)
        return 0.0;
    else if (a * a >= 2.0 * jerk * v)
        return v * (1.0 - a / jerk);
    else
        covered = a * (peak - a * a / (6.0 * jerk)) / jerk;
    if (peak <= 0.0) return 0.0;
    rest = peak * jerk <= top * top ? peak * sqrt(peak / jerk) : 0.5 * peak * (peak / top + top / jerk);
    return most(covered + rest, 0.0);
}

/* Acceleration of the next step towards a goal that is `step` away and moves by `goal_v` in a step; whether the joint is there
   and as fast after it. */
static inline double acceleration_to(double step, double goal_v, double v, double a, double high, double top, double jerk, int *is_there) {
    double upper = least(least(a + jerk, top), ramp(high - v, jerk));
    double lower = most(most(a - jerk, -top), -ramp(high + v, jerk));
    double wanted = step - v;
    *is_there = lower <= wanted && wanted <= upper && ON_TRACK * fabs(step - goal_v) <= jerk;
    if (*is_there) return wanted;
    double sign = step >= goal_v ? 1.0 : -1.0;
    double ahead = sign * (step - goal_v), speed = sign * (v - goal_v), bent = sign * a;
    double full = sign > 0 ? upper : -lower, slow = sign > 0 ? lower : -upper;
    double planned_a = PLANNED * top, planned_j = PLANNED * jerk;
    slow = least(most(brake(speed, bent, planned_a, planned_j), slow), full);
    double room = ahead - speed - full - overrun(speed + full, full, planned_a, planned_j);
    if (room >= 0.0) return sign * full;
    double rest = ahead - speed - slow - overrun(speed + slow, slow, planned_a, planned_j);
    return sign * (rest <= 0.0 ? slow : slow + (full - slow) * rest / (rest - room));
}

#endif
