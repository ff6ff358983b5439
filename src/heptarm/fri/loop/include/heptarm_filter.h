/* Low passes for the commands and readings of control laws in C or C++.

   A filter's state is in the law's memory. Before the first step, set `y` to the first reading, and `rate` to 0. */
#ifndef HEPTARM_FILTER_H
#define HEPTARM_FILTER_H

#include <math.h>

#define HEPTARM_TURN 6.28318530717958647692

/* A step of a low pass of first order, exact for an input that is constant within the step; frequency in Hz, dt in s. */
static inline void heptarm_low_pass_1(double *y, double x, double frequency, double dt) {
    *y += (1.0 - exp(-HEPTARM_TURN * frequency * dt)) * (x - *y);
}

/* A step of a low pass of second order, semi-implicit: stable at every frequency. A damping of 1 is the fastest without overshoot. */
static inline void heptarm_low_pass_2(double *y, double *rate, double x, double frequency, double damping, double dt) {
    double w = HEPTARM_TURN * frequency;
    *rate = (*rate + dt * w * w * (x - *y)) / (1.0 + dt * w * (2.0 * damping + dt * w));
    *y += dt * *rate;
}

#endif
