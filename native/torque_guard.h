/* Guard of superposed torques: whatever a law computes, no axis passes its speed or its position limit.

   A filter in the space of accelerations. With the inertia matrix M of the posture, a torque means the acceleration M^-1 tau.
   Each axis has a range of accelerations from which it can still stop before its limits at the planned deceleration, and
   approaches its largest speed without passing it; torques that lead outside are changed by M (allowed - asked), which leaves
   the other axes as they are (a safety filter with control barrier functions: Ames et al., "Control Barrier Functions: Theory
   and Applications", 2019). Where a torque is too large for the motors, the law's part is scaled down before the braking part.

   Two delays are bridged with the torques that were sent: a velocity by differences is half a period old, and an answer acts one
   period after its message. What the model does not explain (the cabinet's spring, a hand, a load that nobody declared) is
   estimated from the motion.

   Base axes, SI units; arrays of seven doubles. */
#ifndef HEPTARM_TORQUE_GUARD_H
#define HEPTARM_TORQUE_GUARD_H

#include "dynamics.h"

/* Constants and state, doubles only, in the order of heptarm.fri.guard.torque_guard. */
struct torque_guard {
    struct robot robot;
    double low[N], high[N], dq_max[N], ddq_max[N], tau_max[N]; /* limits; ddq_max: planned deceleration */
    double is_started;
    double before[N];           /* velocity of the previous message */
    double sent[N], earlier[N]; /* accelerations by the last torques and by those before them */
    double oldest[N];           /* and before them */
    double unknown[N];          /* estimated acceleration that the model does not explain */
    double cap[N];              /* largest speed while the arm brakes to rest */
    double asked[N], allowed[N]; /* for the report: speed or position to which a limited axis would have gone, and its limit */
};

/* Fraction of the largest speed up to which torques accelerate: the rest is for what the model does not know. */
#define GUARDED_SPEED 0.85
/* Distance to the position limit at which an axis comes to rest, beside that of a delay [rad]. */
#define GUARDED_DISTANCE 0.01
/* Time constants: approach to a limit, and estimate of the unknown acceleration [s]; a shorter one than four periods is not stable. */
#define GUARD_TIME 0.02
#define UNKNOWN_TIME 0.012
/* Fraction of the torque that is left beside gravity with which the arm plans to brake. */
#define BRAKING_TORQUE 0.6
/* Fraction of the torque that is left in any case: the motors' limits are not exact. */
#define LEAST_TORQUE 0.1
/* An unknown acceleration that holds an axis back may end at any moment: so much of the largest speed may come of it. */
#define RELEASED 0.08

/* A measured position [rad] or a velocity [rad/s] beyond it is none: a number of a damaged message, which would become an infinite torque. */
#define POSSIBLE_POSITION (2.0 * M_PI)
#define POSSIBLE_SPEED 1e5

/* Part of the acceleration that a wrench can cause by which it plans to brake, and least planned deceleration: of that of the axis. */
#define AUTHORITY 0.4
#define LEAST_DECELERATION 0.02
/* Weight of a range of accelerations that is exceeded: the square of an acceleration, over the speed of its axis, that is hardly
   worth a wrench [1/s2]; largest number of sweeps, and change at which they end. */
#define WRENCH_SLACK 1e-2
#define WRENCH_SWEEPS 60
/* Power that a wrench may still give the arm where an axis reaches its bound, none from a part of that beyond it [W]: in a singular
   posture what brakes one axis would drive another one. */
#define WRENCH_POWER 20.0
#define WRENCH_OVER 0.1
/* Singular value of the Jacobian below which a wrench moves the arm more slowly, and least fraction of its speed there. */
#define NEAR_SINGULAR 0.1
#define LEAST_FRACTION 0.3
#define WRENCH_EXACT 1e-7

/* While the arm brakes: time constant with which a motion decays [s], and fraction of the largest speed with which a spring that the
   torques have wound may unwind: without them it would throw the arm. */
#define UNWINDING_TIME 0.1
#define UNWINDING_SPEED 0.3

/* What was limited, by axis: bit i for the speed, bit 8 + i for the position, bit 16 + i for the torque. */
enum { GUARD_SPEED_BIT = 0, GUARD_POSITION_BIT = 8, GUARD_TORQUE_BIT = 16 };

static inline double guard_clamp(double value, double low, double high) { return value < low ? low : value > high ? high : value; }

/* Torques that are left beside those with which the cabinet compensates gravity and Coriolis torques; deceleration with which
   every axis can brake at the same time, at most that planned. */
static inline void torques_left(const struct torque_guard *g, const struct posture *posture, const double *dq, double mass[N][N],
                                double *least, double *most, double *deceleration) {
    static const double still[N], fall[3] = {0.0, 0.0, -9.81};
    double bias[N], scale = 1.0;
    inverse_dynamics(posture, dq, still, fall, bias);
    for (int i = 0; i < N; i++) {
        double needed = 0.0, some = LEAST_TORQUE * g->tau_max[i];
        most[i] = fmax(some, fmin(g->tau_max[i], g->tau_max[i] - bias[i]));
        least[i] = fmin(-some, fmax(-g->tau_max[i], -g->tau_max[i] - bias[i]));
        for (int k = 0; k < N; k++) needed += fabs(mass[i][k]) * g->ddq_max[k];
        scale = fmin(scale, BRAKING_TORQUE * fmin(most[i], -least[i]) / needed);
    }
    for (int i = 0; i < N; i++) deceleration[i] = scale * g->ddq_max[i];
}

/* Largest speed towards a limit that is `room` away, and its slope over the room: it stops there at a deceleration, and slowly
   at the end, as v = room / (2 time). */
static inline double speed_before(double room, double deceleration, double time, double *slope) {
    double near = 4.0 * deceleration * time * time; /* the parabola goes on tangentially as a line */
    *slope = room > 0.0 ? 0.5 / time : 0.0;
    if (room <= 0.0) return 0.0;
    if (room <= near) return 0.5 * room / time;
    double speed = sqrt(2.0 * deceleration * (room - 0.5 * near));
    *slope = deceleration / speed;
    return speed;
}

/* Largest acceleration upwards; mirrored, that downwards. */
static inline double highest_acceleration(double room, double v, double top, double deceleration, double time, int *by_position) {
    double slope, speed = speed_before(room, deceleration, time, &slope);
    *by_position = speed < top;
    if (!*by_position) return (top - v) / time;
    return (speed - v) / time - (v > 0.0 ? slope * fmin(v, top) : 0.0);
}

static inline void start_torque_guard(struct torque_guard *g) {
    g->is_started = 0.0;
    for (int i = 0; i < N; i++) g->sent[i] = g->earlier[i] = g->oldest[i] = g->unknown[i] = g->before[i] = 0.0;
}

/* Fraction of the largest speed, distance from a position limit [rad], and fraction of the planned deceleration with which the arm is
   guarded. A wrench cannot brake every axis by itself, so it keeps more. */
struct reserve {
    double speed, distance, deceleration;
};
static const struct reserve of_torques = {GUARDED_SPEED, GUARDED_DISTANCE, 1.0}, of_wrench = {0.5, 0.03, 0.4};

/* What a guard knows of a cycle.

   posture, mass, factor: of the measured position; `factor` is that of `mass`.
   least, most: torques that are left [Nm].
   v: velocities when the answer acts [rad/s]; there: positions [rad].
   a: accelerations that the law asks for, low, high: and their ranges [rad/s2]. */
struct cycle {
    struct posture posture;
    double mass[N][N], factor[N * N], least[N], most[N], v[N], there[N], a[N], low[N], high[N];
};

/* Look at the posture of a cycle; 0: there is none, and without a position there is no safe torque. */
static inline int look(struct torque_guard *g, const double *q, const double *dq, struct cycle *c) {
    int is_known = 1;
    for (int i = 0; i < N; i++) is_known &= fabs(q[i]) <= POSSIBLE_POSITION && fabs(dq[i]) <= POSSIBLE_SPEED; /* not if NaN */
    if (is_known) {
        find_posture(&g->robot, q, &c->posture);
        moved_mass(&g->robot, &c->posture, c->mass);
        memcpy(c->factor, c->mass, sizeof c->factor);
        is_known = factorise(c->factor, N); /* no posture has another matrix */
    }
    if (!is_known) start_torque_guard(g);
    return is_known;
}

/* Find the ranges of the accelerations of a cycle, and what the law asks for; while the arm brakes that is the motion's decay.

   authority: largest accelerations that the law can cause [rad/s2]; NULL: whatever the motors can.
   tau: torques of the law [Nm]. The result is that of `guard_torques`. */
static inline int find_ranges(struct torque_guard *g, const struct reserve *kept, const double *authority, const double *q, const double *dq,
                              double dt, int is_braking, const double *tau, struct cycle *c) {
    double deceleration[N], time = fmax(GUARD_TIME, 4.0 * dt);
    int found = 0;
    torques_left(g, &c->posture, dq, c->mass, c->least, c->most, deceleration);
    for (int i = 0; i < N; i++) {
        deceleration[i] *= kept->deceleration;
        if (authority) deceleration[i] = fmax(fmin(deceleration[i], AUTHORITY * authority[i]), LEAST_DECELERATION * g->ddq_max[i]);
        if (g->is_started != 0.0) {
            double unexplained = (dq[i] - g->before[i]) / dt - 0.5 * (g->earlier[i] + g->oldest[i]);
            g->unknown[i] += dt / (UNKNOWN_TIME + dt) * (unexplained - g->unknown[i]);
        }
        g->before[i] = dq[i];
        c->a[i] = tau[i];
    }
    solve(c->factor, N, c->a);
    for (int i = 0; i < N; i++) {
        int is_high_by_position, is_low_by_position;
        double full = kept->speed * g->dq_max[i], release = RELEASED * g->dq_max[i] / (UNKNOWN_TIME + dt);
        double above = fmax(g->unknown[i], -release), below = fmin(g->unknown[i], release);
        /* when the answer acts */
        double now = dq[i] + 0.5 * dt * (g->earlier[i] + g->unknown[i]);
        double v = c->v[i] = now + dt * (g->sent[i] + g->unknown[i]), there = c->there[i] = q[i] + 0.5 * dt * (now + v);
        g->cap[i] = is_braking ? fmax(UNWINDING_SPEED * g->dq_max[i], fmin(g->cap[i], fabs(v)) - deceleration[i] * dt) : full;
        if (is_braking) c->a[i] = -v / UNWINDING_TIME;
        double top = fmin(full, g->cap[i]), gap = kept->distance + dt * fabs(v);
        c->high[i] = highest_acceleration(g->high[i] - gap - there, v, top, deceleration[i], time, &is_high_by_position) - above;
        c->low[i] = -highest_acceleration(there - gap - g->low[i], -v, top, deceleration[i], time, &is_low_by_position) - below;
        if (c->low[i] > c->high[i]) c->low[i] = c->high[i] = 0.5 * (c->low[i] + c->high[i]);
        int is_high = c->a[i] > c->high[i];
        if (is_braking || !(is_high || c->a[i] < c->low[i])) continue;
        int is_position = is_high ? is_high_by_position : is_low_by_position;
        found |= 1 << (i + (is_position ? GUARD_POSITION_BIT : GUARD_SPEED_BIT));
        double speed = v + time * c->a[i];
        g->asked[i] = is_position ? there + 0.5 * speed * fabs(speed) / deceleration[i] : speed;
        g->allowed[i] = is_position ? (is_high ? g->high[i] : g->low[i]) : (is_high ? full : -full);
    }
    return found;
}

/* Remember the accelerations that the answer causes. */
static inline void remember(struct torque_guard *g, const double *sent) {
    for (int i = 0; i < N; i++) {
        g->oldest[i] = g->earlier[i];
        g->earlier[i] = g->sent[i];
        g->sent[i] = sent[i];
    }
    g->is_started = 1.0;
}

/* Limit torques.

   q, dq: measured positions and their difference to the previous message by the period.
   dt: command period. is_braking: bring the arm to rest where its spring is not wound, whatever the torques are.
   tau: target torques [Nm], finite; replaced by those to send.
   Returns the bits of what was limited; g->asked and g->allowed have the values of these axes. */
static inline int guard_torques(struct torque_guard *g, const double *q, const double *dq, double dt, int is_braking, double *tau) {
    struct cycle c;
    double change[N], rest[N], braking[N], sent[N], fraction = 1.0, strength = 1.0;
    if (!look(g, q, dq, &c)) {
        for (int i = 0; i < N; i++) tau[i] = 0.0;
        return 0;
    }
    int found = find_ranges(g, &of_torques, NULL, q, dq, dt, is_braking, tau, &c);
    for (int i = 0; i < N; i++) {
        change[i] = guard_clamp(c.a[i], c.low[i], c.high[i]) - c.a[i];
        rest[i] = guard_clamp(0.0, c.low[i], c.high[i]);
    }
    for (int i = 0; i < N && is_braking; i++) tau[i] = dot(c.mass[i], c.a, N);
    for (int i = 0; i < N; i++) {
        braking[i] = dot(c.mass[i], rest, N);
        double bounded = guard_clamp(braking[i], c.least[i], c.most[i]);
        if (bounded != braking[i]) strength = fmin(strength, bounded / braking[i]);
    }
    for (int i = 0; i < N; i++) {
        braking[i] *= strength; /* weaker, and towards the range of every axis */
        tau[i] += dot(c.mass[i], change, N);
        double bounded = guard_clamp(tau[i], c.least[i], c.most[i]);
        if (bounded == tau[i]) continue;
        fraction = fmin(fraction, (bounded - braking[i]) / (tau[i] - braking[i]));
        found |= 1 << (i + GUARD_TORQUE_BIT);
        if (!(found >> i & 0x101)) g->asked[i] = tau[i], g->allowed[i] = bounded;
    }
    for (int i = 0; i < N; i++) sent[i] = tau[i] = braking[i] + fraction * (tau[i] - braking[i]);
    solve(c.factor, N, sent);
    remember(g, sent);
    return found;
}

/* Find the wrench that is nearest to another one and keeps every axis within its range of accelerations.

   A quadratic program with slack, by dual coordinate ascent (Hildreth, "A quadratic programming procedure", 1957). A wrench has one
   direction less than the arm has joints, and its size is bounded: where no wrench keeps all ranges, it is the one that
   exceeds them least, relative to the speed of each axis.
   effect: accelerations by the largest components of the wrench, over each axis' speed [1/s], then the power that they give the arm,
      over WRENCH_POWER; low, high: ranges, likewise.
   wrench: fractions of the largest components; replaced. */
static inline void nearest_wrench(double effect[N + 1][6], const double *low, const double *high, double *wrench) {
    double size[N + 1], pull[N + 1], push[6];
    for (int i = 0; i <= N; i++) size[i] = dot(effect[i], effect[i], 6) + WRENCH_SLACK, pull[i] = 0.0;
    for (int r = 0; r < 6; r++) push[r] = 0.0;
    for (int sweep = 0; sweep < WRENCH_SWEEPS; sweep++) {
        double largest = 0.0;
        for (int i = 0; i <= N; i++) {
            double now = dot(effect[i], wrench, 6) + WRENCH_SLACK * pull[i], up = (now - high[i]) / size[i], down = (now - low[i]) / size[i];
            /* one of the two multipliers is zero: positive ones are of the lower bound */
            double next = pull[i] - up < 0.0 ? pull[i] - up : pull[i] - down > 0.0 ? pull[i] - down : 0.0;
            double by = next - pull[i];
            pull[i] = next;
            for (int r = 0; r < 6; r++) wrench[r] += by * effect[i][r];
            largest = fmax(largest, fabs(by) * size[i]);
        }
        for (int r = 0; r < 6; r++) {
            double free = wrench[r] - push[r], inside = guard_clamp(free, -1.0, 1.0);
            push[r] = inside - free;
            largest = fmax(largest, fabs(inside - wrench[r]));
            wrench[r] = inside;
        }
        if (largest < WRENCH_EXACT) return;
    }
}

/* Fraction of its bounds of the speeds that a wrench may use in a posture: near a singularity a small motion of the flange
   becomes a large one of two axes against each other, which no wrench can brake.

   By the smallest singular value of the Jacobian, from inverse iteration on its square. */
static inline double fraction_near_singularity(double j[6][N]) {
    double square[36], x[6], size = 1.0;
    for (int r = 0; r < 6; r++) {
        x[r] = 1.0;
        for (int k = 0; k < 6; k++) square[6 * r + k] = dot(j[r], j[k], N);
    }
    if (!factorise(square, 6)) return LEAST_FRACTION;
    for (int round = 0; round < 3; round++) {
        for (int r = 0; r < 6; r++) x[r] /= size;
        solve(square, 6, x);
        size = sqrt(dot(x, x, 6));
    }
    return guard_clamp(1.0 / (sqrt(size) * NEAR_SINGULAR), LEAST_FRACTION, 1.0);
}

/* Limit a wrench on the flange [N, Nm], base axes, by the motion to which it leads; arguments and result as above.

   most: largest components of the wrench. */
static inline int guard_wrench(struct torque_guard *g, const double *q, const double *dq, double dt, int is_braking, const double *most,
                               double *wrench) {
    struct cycle c;
    double j[6][N], tau[N], caused[6][N], effect[N + 1][6], authority[N], low[N + 1], high[N + 1], target[6], sent[N], over = 0.0;
    if (!look(g, q, dq, &c)) {
        for (int r = 0; r < 6; r++) wrench[r] = 0.0;
        return 0;
    }
    jacobian(c.posture.axis, c.posture.origin, c.posture.place, j);
    for (int i = 0; i < N; i++) tau[i] = authority[i] = 0.0;
    for (int r = 0; r < 6; r++) {
        target[r] = most[r] > 0.0 ? guard_clamp(wrench[r] / most[r], -1.0, 1.0) : 0.0;
        memcpy(caused[r], j[r], sizeof caused[r]);
        solve(c.factor, N, caused[r]);
        for (int i = 0; i < N; i++) {
            caused[r][i] *= most[r];
            effect[i][r] = caused[r][i] / g->dq_max[i];
            authority[i] += fabs(caused[r][i]);
            tau[i] += j[r][i] * wrench[r];
        }
    }
    struct reserve kept = of_wrench;
    kept.speed *= fraction_near_singularity(j);
    int found = find_ranges(g, &kept, authority, q, dq, dt, is_braking, tau, &c);
    if (is_braking) { /* the wrench that is nearest to the decay of the motion */
        double square[36];
        for (int r = 0; r < 6; r++) {
            target[r] = 0.0;
            for (int i = 0; i < N; i++) target[r] += effect[i][r] * c.a[i] / g->dq_max[i];
            for (int k = 0; k < 6; k++) {
                square[6 * r + k] = r == k ? WRENCH_SLACK : 0.0;
                for (int i = 0; i < N; i++) square[6 * r + k] += effect[i][r] * effect[i][k];
            }
        }
        if (factorise(square, 6)) solve(square, 6, target);
        for (int r = 0; r < 6; r++) target[r] = guard_clamp(target[r], -1.0, 1.0);
    }
    if (found || is_braking) {
        for (int i = 0; i < N; i++) low[i] = c.low[i] / g->dq_max[i], high[i] = c.high[i] / g->dq_max[i];
        for (int i = 0; i < N; i++) over = fmax(over, (fabs(dq[i]) / g->dq_max[i] / kept.speed - 1.0) / WRENCH_OVER);
        for (int r = 0; r < 6; r++) effect[N][r] = over > 0.0 ? dot(j[r], dq, N) * most[r] / WRENCH_POWER : 0.0;
        low[N] = -INFINITY, high[N] = fmax(0.0, 1.0 - over);
        nearest_wrench(effect, low, high, target);
        for (int r = 0; r < 6; r++) wrench[r] = target[r] * most[r];
    }
    for (int i = 0; i < N; i++) {
        sent[i] = 0.0;
        for (int r = 0; r < 6; r++) sent[i] += caused[r][i] * target[r];
    }
    remember(g, sent);
    return found;
}

#endif
