/* Guards of the FRI client: they limit what is sent, and report what they limited.

   Joint guard. Every axis is limited by itself, in steps of the command period: position, velocity, acceleration and jerk. Each
   step starts and ends in a state from which the axis can stop before its position limit, so that the limits hold by induction
   from the start, which is position and velocity of the interpolator. A target that moves within the limits passes unchanged;
   any other is approached so that the axis just stops there.

   The stop that counts is the cabinet's, not the client's: when answers cease, the cabinet goes on with the last velocity for
   `coast` steps and then brakes, and when a session ends by a stop, it brakes at once. An axis is therefore never faster than what
   may go on for so long and still stop before the limit.

   Pose guard. Translation, rotation and redundancy angle are limited separately, velocity and acceleration of each as a vector
   in base axes.

   Every number of a guard's state is finite: a start refuses what is not, a target that is not keeps the last one. */
#include "fri.h"
#include "torque_guard.h"

/* For so long the cabinet goes on without an answer [s], at least two command periods; see heptarm.sim.fri.limits. */
#define COAST 5e-3
#define COAST_PERIODS 2.0
/* Relative tolerance of the limits, for rounding; of a distance to a position limit [rad]. */
#define ROUNDING 1e-9
#define SLACK 1e-12

static double clamp(double value, double low, double high) { return least(most(value, low), high); }

static double finite_or(double value, double other) { return isfinite(value) ? value : other; }

static void count_limited(const struct limit_report *report, int place, double asked, double allowed) {
    report->counts[place]++;
    if (fabs(asked) >= report->worst[place]) {
        report->worst[place] = fabs(asked);
        report->allowed[place] = fabs(allowed);
    }
}

/* ------------------------------------------------------------------------------------------------------- joint guard */

static void limited(struct joint_guard *g, int kind, int axis, double asked, double allowed) {
    g->was_limited = 1;
    count_limited(&g->report, AXES * kind + axis, asked, allowed);
}

/* Convert the limits to steps of the command period [s]. */
static void scale_joints(struct joint_guard *g, double period) {
    double more = 1.0 + ROUNDING;
    g->period = period;
    g->coast = most(COAST, COAST_PERIODS * period) / period;
    for (int i = 0; i < AXES; i++) {
        g->top_v[i] = g->limits.dq_max[i] * period * more;
        g->top_a[i] = g->limits.ddq_max[i] * period * period * more;
        g->top_j[i] = g->limits.dddq_max[i] * period * period * period * more;
        /* closer to a position limit than this, the stopping distance has to be checked */
        g->near[i] = overrun(g->top_v[i], g->top_a[i], g->top_a[i], g->top_j[i]) + g->top_v[i] * (1.0 + g->coast);
    }
}

/* Start from position and velocity of the interpolator [rad, rad/s], with zero torque; from outside the position limits an axis
   can only move inwards. */
void joint_guard_start(struct joint_guard *g, const double *q, const double *dq, double period) {
    scale_joints(g, period);
    memset(g->tau, 0, sizeof g->tau);
    memset(g->wrench, 0, sizeof g->wrench);
    for (int i = 0; i < AXES; i++) {
        double here = finite_or(q[i], g->q[i]), v = clamp(finite_or(dq[i], 0.0) * period, -g->top_v[i], g->top_v[i]);
        double a = g->top_a[i], j = g->top_j[i];
        g->q[i] = g->r[i] = here;
        g->v[i] = v;
        g->a[i] = 0.0;
        g->low[i] = least(g->limits.q_min[i], here - overrun(-v, 0.0, a, j) - g->coast * most(-v, 0.0));
        g->high[i] = most(g->limits.q_max[i], here + overrun(v, 0.0, a, j) + g->coast * most(v, 0.0));
    }
    g->is_started = 1;
    g->was_limited = 0;
}

int joint_guard_is_still(const struct joint_guard *g) {
    for (int i = 0; i < AXES; i++)
        if (g->v[i] != 0.0 || g->a[i] != 0.0) return 0;
    return 1;
}

static void report_violation(struct joint_guard *g, int i, double step, double wanted, double a) {
    double t = g->period;
    if (fabs(step) > g->top_v[i])
        limited(g, LIMITED_VELOCITY, i, step / t, g->limits.dq_max[i]);
    else if (fabs(wanted) > g->top_a[i])
        limited(g, LIMITED_ACCELERATION, i, wanted / (t * t), g->limits.ddq_max[i]);
    else
        limited(g, LIMITED_JERK, i, (wanted - a) / (t * t * t), g->limits.dddq_max[i]);
}

/* Limit a target to the position limits and the reach. */
static double bounded(struct joint_guard *g, int i, double goal, double before, const double *ipo) {
    if (!isfinite(goal)) {
        limited(g, LIMITED_NOT_FINITE, i, 0.0, 0.0);
        return before;
    }
    double low = g->low[i], high = g->high[i];
    if (ipo) {
        double lower = most(low, least(ipo[i] - g->limits.reach, high));
        high = least(high, most(ipo[i] + g->limits.reach, lower));
        low = lower;
    }
    double kept = clamp(goal, low, high);
    if (kept != goal) limited(g, LIMITED_POSITION, i, goal, kept);
    return kept;
}

/* By how much an axis would pass a position limit after a step with this acceleration, if the cabinet then had to stop it. */
static double excess(const struct joint_guard *g, int i, double acc) {
    double speed = g->v[i] + acc, there = g->q[i] + speed, top = g->top_a[i], jerk = g->top_j[i];
    double above = there + overrun(speed, acc, top, jerk) + g->coast * most(speed, 0.0) - g->high[i];
    double below = g->low[i] - there + overrun(-speed, -acc, top, jerk) + g->coast * most(-speed, 0.0);
    return most(above, below);
}

/* The acceleration nearest to a planned one with which the axis still stops before its position limit. */
static double held_back(const struct joint_guard *g, int i, double acc) {
    double over = excess(g, i, acc);
    if (over <= 0.0) return acc;
    double braking = brake(g->v[i], g->a[i], g->top_a[i], g->top_j[i]), room = excess(g, i, braking);
    if (room >= 0.0) return braking;
    double kept = braking + (acc - braking) * room / (room - over);
    return excess(g, i, kept) <= SLACK ? kept : braking;
}

/* Acceleration of this step towards a moving goal that cannot be reached in one step. */
static double approach(struct joint_guard *g, int i, double goal, double before) {
    double v = g->v[i], a = g->a[i], high = g->top_v[i], step = goal - g->q[i], wanted = step - v;
    int is_there;
    double acc = acceleration_to(step, clamp(goal - before, -high, high), v, a, high, g->top_a[i], g->top_j[i], &is_there);
    double kept = held_back(g, i, acc);
    if (!is_there || kept != acc) report_violation(g, i, step, wanted, a);
    return kept;
}

/* Limit a target position [rad]; without one every axis brakes to a stop. The result is in `q`. */
void joint_guard_position(struct joint_guard *g, const double *target, const double *ipo) {
    g->was_limited = 0;
    for (int i = 0; i < AXES; i++) {
        double now = g->q[i], speed = g->v[i], acc;
        if (!target) {
            acc = brake(speed, g->a[i], g->top_a[i], g->top_j[i]);
            g->v[i] = speed + acc;
            g->a[i] = acc;
            g->q[i] = g->r[i] = now + g->v[i];
            continue;
        }
        double goal = target[i], before = g->r[i], jerk = g->top_j[i];
        if (!(g->low[i] <= goal && goal <= g->high[i]) || ipo) goal = bounded(g, i, goal, before, ipo);
        g->r[i] = goal;
        double step = goal - now;
        acc = step - speed;
        if (fabs(ON_TRACK * (step - goal + before)) <= jerk && fabs(acc - g->a[i]) <= jerk && /* the most frequent case */
            fabs(step) + acc * acc / (2.0 * jerk) <= g->top_v[i] && fabs(acc) <= g->top_a[i] &&
            g->low[i] + g->near[i] <= goal && goal <= g->high[i] - g->near[i]) {
            g->q[i] = goal;
            g->v[i] = step;
            g->a[i] = acc;
            continue;
        }
        acc = approach(g, i, goal, before);
        g->v[i] = speed + acc;
        g->a[i] = acc;
        g->q[i] = acc == step - speed ? goal : now + g->v[i];
    }
}

static void slew(struct joint_guard *g, double *last, const double *target, const double *limit, const double *rate, int size, int kind) {
    for (int i = 0; i < size; i++) {
        double kept = last[i], step = rate[i] * g->period;
        if (isfinite(target[i])) {
            kept = clamp(target[i], -limit[i], limit[i]);
            if (kept != target[i]) limited(g, kind, i, target[i], limit[i]);
        } else {
            limited(g, LIMITED_NOT_FINITE, i, 0.0, 0.0);
        }
        last[i] = clamp(kept, last[i] - step, last[i] + step);
    }
}

/* Report what the guard of the motion has limited. */
static void limited_by_motion(struct joint_guard *g, const struct torque_guard *motion, int found) {
    static const struct {
        int bit, kind;
    } parts[] = {{GUARD_SPEED_BIT, LIMITED_VELOCITY}, {GUARD_POSITION_BIT, LIMITED_POSITION}, {GUARD_TORQUE_BIT, LIMITED_TORQUE}};
    for (int part = 0; part < 3 && found; part++)
        for (int i = 0; i < AXES; i++)
            if (found >> (parts[part].bit + i) & 1) limited(g, parts[part].kind, i, motion->asked[i], motion->allowed[i]);
}

/* Limit magnitude and rate of torques [Nm], then the motion to which they lead (torque_guard.h); the result is in `tau_sent`. Call
   it after the position; q and dq are measured. */
void joint_guard_torque(struct joint_guard *g, const double *target, struct torque_guard *motion, const double *q, const double *dq, int is_braking) {
    slew(g, g->tau, target, g->limits.tau_max, g->limits.dtau_max, AXES, LIMITED_TORQUE);
    memcpy(g->tau_sent, g->tau, sizeof g->tau_sent);
    limited_by_motion(g, motion, guard_torques(motion, q, dq, g->period, is_braking, g->tau_sent));
}

void fri_start_torque_guard(struct torque_guard *guard) { start_torque_guard(guard); }

int fri_guard_torques(struct torque_guard *guard, const double *q, const double *dq, double dt, int is_braking, double *tau) {
    return guard_torques(guard, q, dq, dt, is_braking, tau);
}

int fri_guard_wrench(struct torque_guard *guard, const double *q, const double *dq, double dt, int is_braking, const double *most, double *wrench) {
    return guard_wrench(guard, q, dq, dt, is_braking, most, wrench);
}

/* Limit magnitude and rate of a wrench [N, Nm], then the motion to which it leads; the result is in `wrench_sent`. Call it after the
   position; q and dq are measured. */
void joint_guard_force(struct joint_guard *g, const double *target, struct torque_guard *motion, const double *q, const double *dq, int is_braking) {
    slew(g, g->wrench, target, g->limits.wrench_max, g->limits.dwrench_max, 6, LIMITED_WRENCH);
    memcpy(g->wrench_sent, g->wrench, sizeof g->wrench_sent);
    limited_by_motion(g, motion, guard_wrench(motion, q, dq, g->period, is_braking, g->limits.wrench_max, g->wrench_sent));
}

/* ------------------------------------------------------------------------------------------------- vectors and poses */

static double norm(const double *a) { return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

static void minus(const double *a, const double *b, double *c) {
    for (int i = 0; i < 3; i++) c[i] = a[i] - b[i];
}

static void plus(const double *a, const double *b, double *c) {
    for (int i = 0; i < 3; i++) c[i] = a[i] + b[i];
}

static void times(double factor, const double *a, double *c) {
    for (int i = 0; i < 3; i++) c[i] = factor * a[i];
}

static int equals(const double *a, const double *b) { return a[0] == b[0] && a[1] == b[1] && a[2] == b[2]; }

/* Shorten a vector to a length. */
static void shorten(double *a, double longest) {
    double size = norm(a);
    if (!(size <= longest)) times(longest / size, a, a);
}

/* Velocity after one step of braking. */
static void slow_down(double *v, double step) {
    double speed = norm(v);
    times(speed <= step ? 0.0 : 1.0 - step / speed, v, v);
}

/* Normalise a quaternion; 0 if it defines no rotation. */
static int unit(const double *quat, double *into) {
    double size = sqrt(quat[0] * quat[0] + quat[1] * quat[1] + quat[2] * quat[2] + quat[3] * quat[3]);
    if (!(SMALLEST_NORM <= size && size < INFINITY)) return 0;
    for (int i = 0; i < 4; i++) into[i] = quat[i] / size;
    return 1;
}

static void product(const double *p, const double *q, double *into) {
    double x = p[3] * q[0] + p[0] * q[3] + p[1] * q[2] - p[2] * q[1];
    double y = p[3] * q[1] - p[0] * q[2] + p[1] * q[3] + p[2] * q[0];
    double z = p[3] * q[2] + p[0] * q[1] - p[1] * q[0] + p[2] * q[3];
    double w = p[3] * q[3] - p[0] * q[0] - p[1] * q[1] - p[2] * q[2];
    into[0] = x, into[1] = y, into[2] = z, into[3] = w;
}

/* Shortest rotation vector from one unit quaternion to another, base axes [rad]. */
static void turn_to(const double *goal, const double *here, double *turn) {
    double conjugate[4] = {-here[0], -here[1], -here[2], here[3]}, p[4];
    product(goal, conjugate, p);
    double sine = norm(p);
    if (sine == 0.0) {
        turn[0] = turn[1] = turn[2] = 0.0;
        return;
    }
    if (p[3] < 0.0)
        for (int i = 0; i < 4; i++) p[i] = -p[i];
    times(2.0 * atan2(sine, p[3]) / sine, p, turn);
}

/* Rotate a unit quaternion by a rotation vector in base axes [rad]. */
static void rotated(const double *quat, const double *turn, double *into) {
    double angle = norm(turn), scale = angle > 1e-12 ? 0.5 * sin(0.5 * angle) / (0.5 * angle) : 0.5;
    double by[4] = {scale * turn[0], scale * turn[1], scale * turn[2], cos(0.5 * angle)}, p[4];
    product(by, quat, p);
    double size = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
    for (int i = 0; i < 4; i++) into[i] = p[i] / size;
}

/* Translation and rotation vector between two poses (x y z [m], quaternion x y z w), base axes [m, rad]. */
void pose_between(const double *first, const double *second, double *displacement) {
    minus(second, first, displacement);
    turn_to(second + 3, first + 3, displacement + 3);
}

/* Move a pose by a translation and a rotation vector in base axes [m, rad]. */
void pose_moved(const double *pose, const double *displacement, double *into) {
    plus(pose, displacement, into);
    rotated(pose + 3, displacement + 3, into + 3);
}

/* -------------------------------------------------------------------------------------------------------- pose guard */

enum { FLANGE, ROTATION, ELBOW, PARTS };

static void pose_limited(struct pose_guard *g, int kind, int part, double asked, double allowed) {
    g->was_limited = 1;
    count_limited(&g->report, PARTS * kind + part, asked, allowed);
}

static double rate_of(const struct pose_guard *g, int part) {
    return part == FLANGE ? g->limits.velocity : part == ROTATION ? g->limits.angular_velocity : g->limits.elbow_velocity;
}

static double change_of(const struct pose_guard *g, int part) {
    return part == FLANGE ? g->limits.acceleration : part == ROTATION ? g->limits.angular_acceleration : g->limits.elbow_acceleration;
}

static void scale_pose(struct pose_guard *g, double period) {
    g->period = period;
    for (int part = 0; part < PARTS; part++) {
        g->top[part] = rate_of(g, part) * period * (1.0 + ROUNDING);
        g->most[part] = change_of(g, part) * period * period * (1.0 + ROUNDING);
    }
}

/* Start from pose and velocity of the interpolator; its redundancy angle is NaN where it has none. */
void pose_guard_start(struct pose_guard *g, const double *pose, const double *twist, double period, double e1, double e1_speed) {
    scale_pose(g, period);
    for (int i = 0; i < 3; i++) {
        g->xyz[i] = finite_or(pose[i], g->xyz[i]);
        g->v[i] = finite_or(period * twist[i], 0.0);
        g->w[i] = finite_or(period * twist[3 + i], 0.0);
    }
    unit(pose + 3, g->quat);
    memcpy(g->goal_xyz, g->xyz, sizeof g->xyz);
    memcpy(g->goal_quat, g->quat, sizeof g->quat);
    shorten(g->v, g->top[FLANGE]);
    shorten(g->w, g->top[ROTATION]);
    g->e1 = g->e1_goal = e1;
    g->u = clamp(finite_or(e1_speed * period, 0.0), -g->top[ELBOW], g->top[ELBOW]);
    g->is_started = 1;
    g->was_limited = 0;
}

int pose_guard_is_still(const struct pose_guard *g) { return norm(g->v) == 0.0 && norm(g->w) == 0.0 && g->u == 0.0; }

/* Velocity of this step of a part: `ahead` is the vector to the target, `goal_v` the one from the last target to it. */
static void step_towards(struct pose_guard *g, int part, const double *ahead, const double *goal_step, double *v) {
    double top = g->top[part], longest = g->most[part], goal_v[3], lag[3], change[3], wanted[3];
    memcpy(goal_v, goal_step, sizeof goal_v);
    shorten(goal_v, top);
    minus(ahead, goal_v, lag);
    minus(ahead, v, change);
    double far = norm(lag), speed = norm(ahead), bend = norm(change);
    if (speed <= top && bend <= longest && far <= longest) { /* on track, or close enough to be on track with the next step */
        memcpy(v, ahead, sizeof lag);
        return;
    }
    if (speed > top)
        pose_limited(g, POSE_VELOCITY, part, speed / g->period, rate_of(g, part));
    else
        pose_limited(g, POSE_ACCELERATION, part, most(bend, far) / (g->period * g->period), change_of(g, part));
    double planned = PLANNED * longest;
    memcpy(wanted, goal_v, sizeof wanted);
    if (far > 0.0) { /* the largest velocity that still stops at the moving goal with the acceleration `planned` */
        double rate = least(far, planned * (sqrt(0.25 + 2.0 * far / planned) - 0.5));
        times(rate / far, lag, wanted);
        plus(goal_v, wanted, wanted);
        shorten(wanted, top);
    }
    minus(wanted, v, change);
    shorten(change, longest);
    plus(v, change, v);
}

/* Make the numbers of a target finite and limit its reach. */
static void bounded_pose(struct pose_guard *g, const double *target, const double *ipo) {
    int is_finite = 1;
    for (int i = 0; i < 3; i++) {
        is_finite = is_finite && isfinite(target[i]);
        if (isfinite(target[i])) g->goal_xyz[i] = clamp(target[i], -LARGEST_COORDINATE, LARGEST_COORDINATE);
    }
    if (!is_finite) pose_limited(g, POSE_NOT_FINITE, FLANGE, 0.0, 0.0);
    if (!unit(target + 3, g->goal_quat)) pose_limited(g, POSE_NOT_FINITE, ROTATION, 0.0, 0.0);
    if (!ipo) return;
    double away[3], reach = g->limits.reach;
    minus(g->goal_xyz, ipo, away);
    double far = norm(away);
    if (far > reach * (1.0 + ROUNDING)) {
        pose_limited(g, POSE_REACH, FLANGE, far, reach);
        times(reach / far, away, away);
        plus(ipo, away, g->goal_xyz);
    }
}

/* Limit a target pose; without one the flange brakes to a stop. Numbers that are not finite keep the last target. */
void pose_guard_pose(struct pose_guard *g, const double *target, const double *ipo, double *sent) {
    g->was_limited = 0;
    if (!target) {
        slow_down(g->v, g->most[FLANGE]);
        slow_down(g->w, g->most[ROTATION]);
        plus(g->xyz, g->v, g->xyz);
        rotated(g->quat, g->w, g->quat);
        memcpy(g->goal_xyz, g->xyz, sizeof g->xyz);
        memcpy(g->goal_quat, g->quat, sizeof g->quat);
    } else {
        double before[3], before_quat[4], ahead[3], goal_step[3];
        memcpy(before, g->goal_xyz, sizeof before);
        memcpy(before_quat, g->goal_quat, sizeof before_quat);
        bounded_pose(g, target, ipo);
        minus(g->goal_xyz, g->xyz, ahead);
        minus(g->goal_xyz, before, goal_step);
        step_towards(g, FLANGE, ahead, goal_step, g->v);
        if (equals(g->v, ahead))
            memcpy(g->xyz, g->goal_xyz, sizeof g->xyz);
        else
            plus(g->xyz, g->v, g->xyz);
        turn_to(g->goal_quat, g->quat, ahead);
        turn_to(g->goal_quat, before_quat, goal_step);
        step_towards(g, ROTATION, ahead, goal_step, g->w);
        if (equals(g->w, ahead)) { /* of the two equal quaternions the one closer to the last */
            double same = 0.0;
            for (int i = 0; i < 4; i++) same += g->goal_quat[i] * g->quat[i];
            for (int i = 0; i < 4; i++) g->quat[i] = same >= 0.0 ? g->goal_quat[i] : -g->goal_quat[i];
        } else {
            rotated(g->quat, g->w, g->quat);
        }
    }
    memcpy(sent, g->xyz, sizeof g->xyz);
    memcpy(sent + 3, g->quat, sizeof g->quat);
}

/* Limit a target redundancy angle [rad], after the pose; without one it brakes to a stop. */
double pose_guard_elbow(struct pose_guard *g, const double *target) {
    if (!target) {
        double u[3] = {g->u, 0.0, 0.0};
        slow_down(u, g->most[ELBOW]);
        g->u = u[0];
        g->e1 = g->e1_goal = g->e1 + g->u;
        return g->e1;
    }
    double before = g->e1_goal;
    if (!isfinite(*target))
        pose_limited(g, POSE_NOT_FINITE, ELBOW, 0.0, 0.0);
    else
        g->e1_goal = *target;
    double ahead[3] = {g->e1_goal - g->e1, 0.0, 0.0}, goal_step[3] = {g->e1_goal - before, 0.0, 0.0}, u[3] = {g->u, 0.0, 0.0};
    step_towards(g, ELBOW, ahead, goal_step, u);
    g->u = u[0];
    g->e1 = g->u == ahead[0] ? g->e1_goal : g->e1 + g->u;
    return g->e1;
}

/* ------------------------------------------------------------------------------------------------------ after a gap

   KUKA does not document what a controller does without answers: it may continue with the last velocity, brake, or stop. The
   distance it has moved shows which. With constant deceleration from velocity v over the distance d in the time t, the final
   velocity is 2 d / t - v: a controller that continued gives v by this formula, and one that stopped gives zero or a negative
   value, which means rest. Commands that continue from this estimate have no step in any case. */

/* Largest deviation of a reading from the expected setpoint, in command periods of motion. */
#define MAX_DEVIATION 3.0

/* Limit the distance that an axis has moved in a gap to the range from zero to constant velocity; its velocity after the gap. */
double motion_in_gap(double speed, double *distance, double time) {
    double furthest = speed * time;
    *distance = clamp(finite_or(*distance, 0.0), least(furthest, 0.0), most(furthest, 0.0));
    return clamp(2.0 * *distance / time - speed, least(speed, 0.0), most(speed, 0.0));
}

/* Positions and velocities from which to continue after a gap; `then` and `now` are readings of the setpoint before and after
   it, which may deviate permanently from it unless they are exact. */
void joints_after_gap(struct joint_guard *g, const double *then, const double *now, double time, int is_exact, double *q, double *dq) {
    for (int i = 0; i < AXES; i++) {
        double start = g->q[i] - g->v[i], speed = g->v[i] / g->period, distance = now[i] - then[i];
        double velocity = motion_in_gap(speed, &distance, time), expected = start + distance;
        /* the reading lags behind the commands while the axis moves, and no longer once it has stopped */
        double read = now[i] + (start - then[i]) * (speed != 0.0 ? velocity / speed : 0.0);
        int is_near = is_exact && fabs(read - expected) <= MAX_DEVIATION * g->period * fabs(speed);
        q[i] = is_near ? read : expected;
        dq[i] = velocity;
    }
}

/* The same of a part of a pose, along its direction before the gap. */
void vector_in_gap(const double *speed, double *displacement, double time, double *velocity) {
    double size = norm(speed);
    if (size == 0.0) {
        for (int i = 0; i < 3; i++) displacement[i] = velocity[i] = 0.0;
        return;
    }
    double along = (speed[0] * displacement[0] + speed[1] * displacement[1] + speed[2] * displacement[2]) / size;
    double after = motion_in_gap(size, &along, time);
    for (int i = 0; i < 3; i++) {
        displacement[i] = speed[i] * along / size;
        velocity[i] = speed[i] * after / size;
    }
}
