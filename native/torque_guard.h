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

/* Limit torques.

   q, dq: measured positions and their difference to the previous message by the period.
   dt: command period. is_braking: bring the arm to rest where its spring is not wound, whatever the torques are.
   tau: target torques [Nm], finite; replaced by those to send.
   Returns the bits of what was limited; g->asked and g->allowed have the values of these axes. */
static inline int guard_motion(struct torque_guard *g, const struct reserve *kept, const double *q, const double *dq, double dt, int is_braking,
                               double *tau) {
    struct posture posture;
    double mass[N][N], factor[N * N], deceleration[N], a[N], low[N], high[N], change[N], rest[N], v[N], there[N], least[N], most[N];
    int found = 0, by_position, is_high_by_position[N], is_low_by_position[N];
    double time = fmax(GUARD_TIME, 4.0 * dt), sum = 0.0;
    for (int i = 0; i < N; i++) sum += q[i] + dq[i];
    if (!isfinite(sum)) { /* without a position there is no safe torque */
        for (int i = 0; i < N; i++) tau[i] = 0.0;
        start_torque_guard(g);
        return 0;
    }
    find_posture(&g->robot, q, &posture);
    moved_mass(&g->robot, &posture, mass);
    memcpy(factor, mass, sizeof factor);
    if (!factorise(factor, N)) { /* no posture has such a matrix */
        for (int i = 0; i < N; i++) tau[i] = 0.0;
        return 0;
    }
    torques_left(g, &posture, dq, mass, least, most, deceleration);
    for (int i = 0; i < N; i++) deceleration[i] *= kept->deceleration;
    for (int i = 0; i < N; i++) {
        if (g->is_started != 0.0) {
            double unexplained = (dq[i] - g->before[i]) / dt - 0.5 * (g->earlier[i] + g->oldest[i]);
            g->unknown[i] += dt / (UNKNOWN_TIME + dt) * (unexplained - g->unknown[i]);
        }
        g->before[i] = dq[i];
        a[i] = tau[i];
    }
    solve(factor, N, a);
    for (int i = 0; i < N; i++) {
        double full = kept->speed * g->dq_max[i], release = RELEASED * g->dq_max[i] / (UNKNOWN_TIME + dt);
        double above = fmax(g->unknown[i], -release), below = fmin(g->unknown[i], release);
        /* when the answer acts */
        double now = dq[i] + 0.5 * dt * (g->earlier[i] + g->unknown[i]);
        v[i] = now + dt * (g->sent[i] + g->unknown[i]);
        there[i] = q[i] + 0.5 * dt * (now + v[i]);
        g->cap[i] = is_braking ? fmax(UNWINDING_SPEED * g->dq_max[i], fmin(g->cap[i], fabs(v[i])) - deceleration[i] * dt) : full;
        if (is_braking) a[i] = -v[i] / UNWINDING_TIME;
        double top = fmin(full, g->cap[i]), gap = kept->distance + dt * fabs(v[i]);
        high[i] = highest_acceleration(g->high[i] - gap - there[i], v[i], top, deceleration[i], time, &by_position) - above;
        is_high_by_position[i] = by_position;
        low[i] = -highest_acceleration(there[i] - gap - g->low[i], -v[i], top, deceleration[i], time, &by_position) - below;
        is_low_by_position[i] = by_position;
        if (low[i] > high[i]) low[i] = high[i] = 0.5 * (low[i] + high[i]);
        change[i] = guard_clamp(a[i], low[i], high[i]) - a[i];
        rest[i] = guard_clamp(0.0, low[i], high[i]);
        if (change[i] != 0.0 && !is_braking) {
            int is_high = change[i] < 0.0, is_position = is_high ? is_high_by_position[i] : is_low_by_position[i];
            found |= 1 << (i + (is_position ? GUARD_POSITION_BIT : GUARD_SPEED_BIT));
            double speed = v[i] + time * a[i];
            g->asked[i] = is_position ? there[i] + 0.5 * speed * fabs(speed) / deceleration[i] : speed;
            g->allowed[i] = is_position ? (is_high ? g->high[i] : g->low[i]) : (is_high ? full : -full);
        }
    }
    for (int i = 0; i < N && is_braking; i++) tau[i] = dot(mass[i], a, N);
    double braking[N], fraction = 1.0, strength = 1.0;
    for (int i = 0; i < N; i++) {
        braking[i] = dot(mass[i], rest, N);
        double bounded = guard_clamp(braking[i], least[i], most[i]);
        if (bounded != braking[i]) strength = fmin(strength, bounded / braking[i]);
    }
    for (int i = 0; i < N; i++) {
        braking[i] *= strength; /* weaker, and towards the range of every axis */
        tau[i] += dot(mass[i], change, N);
        double bounded = guard_clamp(tau[i], least[i], most[i]);
        if (bounded == tau[i]) continue;
        fraction = fmin(fraction, (bounded - braking[i]) / (tau[i] - braking[i]));
        found |= 1 << (i + GUARD_TORQUE_BIT);
        if (!(found >> i & 0x101)) g->asked[i] = tau[i], g->allowed[i] = bounded;
    }
    for (int i = 0; i < N; i++) a[i] = tau[i] = braking[i] + fraction * (tau[i] - braking[i]);
    solve(factor, N, a);
    for (int i = 0; i < N; i++) {
        g->oldest[i] = g->earlier[i];
        g->earlier[i] = g->sent[i];
        g->sent[i] = a[i];
    }
    g->is_started = 1.0;
    return found;
}

static inline int guard_torques(struct torque_guard *g, const double *q, const double *dq, double dt, int is_braking, double *tau) {
    return guard_motion(g, &of_torques, q, dq, dt, is_braking, tau);
}

/* Weight of a small correction against an exact one, relative to the mean effect of a wrench. */
#define WRENCH_DAMPING 2e-4
/* Weight of the axes that the guard leaves as they are, relative to those that it has to change. */
#define WRENCH_OTHERS 0.5

/* Fraction of the largest speed above its bound over which a damper takes over, and that damper [N s/m], [N m s/rad]. */
#define DAMPED_SPEED 0.1
#define DAMPER_ALONG 150.0
#define DAMPER_ABOUT 5.0

/* Limit a wrench on the flange [N, Nm], base axes, by the motion to which its torques lead; arguments and result as above.

   A wrench has one direction less than the arm has joints. What the guard changes is made by the wrench whose accelerations come
   nearest to those allowed, relative to the speed of each axis; the cabinet's spring holds the rest.
   most: largest components of the wrench. */
static inline int guard_wrench(struct torque_guard *g, const double *q, const double *dq, double dt, int is_braking, const double *most,
                               double *wrench) {
    struct posture posture;
    double mass[N][N], factor[N * N], j[6][N], asked[N], tau[N], change[N], effect[6][N], weight[N], square[36], correction[6], mean = 0.0;
    find_posture(&g->robot, q, &posture);
    jacobian(posture.axis, posture.origin, posture.place, j);
    for (int i = 0; i < N; i++) {
        asked[i] = 0.0;
        for (int r = 0; r < 6; r++) asked[i] += j[r][i] * wrench[r];
        tau[i] = asked[i];
    }
    int found = guard_motion(g, &of_wrench, q, dq, dt, is_braking, tau);
    if (g->is_started == 0.0) { /* without a position there is no safe wrench */
        for (int r = 0; r < 6; r++) wrench[r] = 0.0;
        return 0;
    }
    if (memcmp(asked, tau, sizeof tau) == 0) return found;
    moved_mass(&g->robot, &posture, mass);
    memcpy(factor, mass, sizeof factor);
    if (!factorise(factor, N)) return 0; /* the torques are zero then, and so is the memory of them */
    for (int i = 0; i < N; i++) change[i] = tau[i] - asked[i];
    solve(factor, N, change);
    for (int i = 0; i < N; i++) {
        weight[i] = (fabs(change[i]) > 1e-9 ? 1.0 : WRENCH_OTHERS) / g->dq_max[i];
        change[i] *= weight[i];
    }
    for (int r = 0; r < 6; r++) {
        memcpy(effect[r], j[r], sizeof effect[r]);
        solve(factor, N, effect[r]);
        for (int i = 0; i < N; i++) effect[r][i] *= weight[i];
        mean += dot(effect[r], effect[r], N) / 6.0;
    }
    for (int r = 0; r < 6; r++) {
        for (int c = 0; c < 6; c++) square[6 * r + c] = dot(effect[r], effect[c], N) + (r == c ? WRENCH_DAMPING * mean : 0.0);
        correction[r] = dot(effect[r], change, N);
    }
    if (!factorise(square, 6)) {
        for (int r = 0; r < 6; r++) correction[r] = -wrench[r];
    } else {
        solve(square, 6, correction);
    }
    /* where that does not bound an axis, the wrench of a damper takes over: it never adds energy */
    double excess = 0.0;
    for (int i = 0; i < N; i++) excess = fmax(excess, (fabs(dq[i]) / g->dq_max[i] - of_wrench.speed) / DAMPED_SPEED);
    excess = fmin(excess, 1.0);
    for (int r = 0; r < 6; r++) {
        double damper = -(r < 3 ? DAMPER_ALONG : DAMPER_ABOUT) * dot(j[r], dq, N);
        wrench[r] = guard_clamp((1.0 - excess) * (wrench[r] + correction[r]) + excess * damper, -most[r], most[r]);
    }
    for (int i = 0; i < N; i++) {
        g->sent[i] = 0.0;
        for (int r = 0; r < 6; r++) g->sent[i] += effect[r][i] / weight[i] * wrench[r];
    }
    return found;
}

#endif
