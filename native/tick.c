/* The arithmetic of a tick of the plant: position control, sensors, supervision of the drives, and the written state.
   heptarm.sim.plant.plant says when each function is called. The dynamics are MuJoCo's, whose functions are called through
   pointers.

   tick_layout.h is generated from heptarm.sim.plant.native: the constants, and `struct tick`, whose members all have eight
   bytes. */
#include <math.h>

#include "redundancy.h"
#include "tick_layout.h"

static void copy(double *to, const double *from, word count) {
    for (word i = 0; i < count; i++) to[i] = from[i];
}

/* Row of an inertia matrix times a vector. */
static double row(const double *mass, word stride, int index, const double *vector) {
    const double *at = mass + index * stride;
    double sum = 0.0;
    for (int i = 0; i < AXES; i++) sum += at[i] * vector[i];
    return sum;
}

word ht_size(void) { return sizeof(struct tick); }

/* A clock for MuJoCo's profiler that stands still: to read a real one twenty times takes a twentieth of a tick. */
double ht_no_clock(void) { return 0.0; }

/* What `gains` of position control contains: the stiffness of the axes, and then these. */
enum { MASS_DAMPING = AXES, STIFFNESS_DAMPING };

/* Accelerations that the set-points of three ticks ask for, and how much faster than the arm they are. */
static void aim(const double *gains, const double *points, const double *dq, double *slip, double *acceleration) {
    const double *before = points, *now = before + AXES, *after = now + AXES;
    for (int i = 0; i < AXES; i++) {
        slip[i] = (after[i] - before[i]) * 500.0 - dq[i];
        acceleration[i] = (after[i] - 2.0 * now[i] + before[i]) * 1e6 + gains[MASS_DAMPING] * slip[i];
    }
}

/* Torques of position control; they arrive as the inertia matrix times the accelerations of `aim`. */
static void feed_back(const double *gains, const double *points, const double *q, const double *bias, const double *passive,
                      const double *slip, double *torque) {
    const double *now = points + AXES;
    for (int i = 0; i < AXES; i++) {
        double spring = now[i] - q[i] + gains[STIFFNESS_DAMPING] * slip[i];
        torque[i] = torque[i] + bias[i] - passive[i] + gains[i] * spring;
    }
}

/* Position control without a preload; heptarm.sim.control_laws.laws.PositionLaw explains it and has the gains. */
static void position(const double *gains, const double *points, const double *q, const double *dq, const double *mass, word stride,
                     const double *bias, const double *passive, double *torque) {
    double slip[AXES], acceleration[AXES];
    aim(gains, points, dq, slip, acceleration);
    for (int i = 0; i < AXES; i++) torque[i] = row(mass, stride, i, acceleration);
    feed_back(gains, points, q, bias, passive, slip, torque);
}

/* The same for one that has its numbers in Python: set-points of three ticks, q, dq, bias and passive, and then the torques. */
void ht_position(const double *gains, double *given, const double *mass, word stride) {
    const double *q = given + 3 * AXES, *dq = q + AXES, *bias = dq + AXES, *passive = bias + AXES;
    position(gains, given, q, dq, mass, stride, bias, passive, given + 7 * AXES);
}

/* The motors exert `torque`, as far as they can. */
void ht_drive(struct tick *t) {
    for (int i = 0; i < AXES; i++) {
        double torque = t->torque[i];
        if (torque > t->most[i]) torque = t->most[i];
        if (torque < -t->most[i]) torque = -t->most[i];
        t->torque[i] = t->tau_cmd[i] = t->actuators[i] = torque;
    }
}

/* Position control of a tick. */
void ht_command(struct tick *t) {
    position(t->gains, t->points, t->q, t->dq, t->mass, t->stride, t->bias, t->passive, t->torque);
    ht_drive(t);
}

/* What the torque sensors show and what acts from outside, after the dynamics. Returns LOADED if there is such a load. */
word ht_sense(struct tick *t) {
    /* forces on bodies and unknown payloads appear in no vector of MuJoCo, only in the residual of the controller's model */
    word explained = !t->is_misjudged, found = 0;
    for (word i = 0; explained && i < t->pulls; i++) explained = t->pulled[i] == 0.0;
    for (int i = 0; i < AXES; i++) {
        double acceleration = t->acceleration[i], passive = t->passive[i];
        /* the torque sensors are on the link side of the gear: they do not measure rotor inertia and gear friction */
        t->tau[i] = t->torque[i] - t->armature[i] * acceleration + passive;
        double load = explained ? t->applied[i] + t->constraint[i]
                                : row(t->mass, t->stride, i, t->acceleration) + t->bias[i] - passive - t->torque[i];
        t->load[i] = load;
        if (load != 0.0) found = LOADED;
    }
    return found;
}

/* Whether a drive is outside of a range that it supervises; stiff: the arm shall be where its set-point is. */
word ht_strained(const struct tick *t, word stiff) {
    const double *after = t->points + 2 * AXES, *speed = t->ranges, *place = speed + AXES, *load = place + AXES,
                 *distance = load + AXES;
    for (int i = 0; i < AXES; i++) {
        double q = t->q[i];
        if (!(fabs(t->dq[i] * speed[i]) <= 1.0 && fabs(q * place[i]) <= 1.0 && fabs(t->tau[i] * load[i]) <= 1.0))
            return 1;
        if (stiff && !(fabs((after[i] - q) * distance[i]) <= 1.0)) return 1;
    }
    return 0;
}

/* Position and quaternion of the flange; of the two quaternions the one with w >= 0. */
static void flange(const struct tick *t, const double *q, double *pose) {
    struct frames f;
    walk(&((const struct arm *)t->arm)->chain, q, &f);
    copy(pose, f.place, 3);
    quaternion(f.turn, pose + 3);
    for (int i = 0; i < 4 && pose[6] < 0.0; i++) pose[3 + i] = -pose[3 + i];
}

/* Write a state into its slot of the shared memory; `ht_publish` has to follow. */
void ht_write(struct tick *t, word tick, double progress, double remaining) {
    const double *q = t->shown;
    word *words = t->memory + STATES + tick % SLOTS * SIZE;
    double *reals = (double *)words;
    word turns = 0;
    __atomic_store_n(words + SEQ, 2 * tick + 1, __ATOMIC_RELAXED);
    __atomic_thread_fence(__ATOMIC_SEQ_CST);
    words[TIME] = tick * TICK_NS;
    copy(reals + Q, q, AXES);
    copy(reals + Q_CMD, t->points + 2 * AXES, AXES);
    copy(reals + DQ, t->dq, AXES);
    copy(reals + TAU, t->tau, AXES);
    copy(reals + TAU_EXT, t->load, AXES);
    copy(reals + TAU_CMD, t->tau_cmd, AXES);
    copy(reals + WRENCH, t->wrench, 6);
    flange(t, q, reals + POSE);
    words[FLAGS] = t->flags;
    words[MODE] = t->mode;
    words[ORDER] = t->order;
    reals[PROGRESS] = progress;
    reals[REMAINING] = remaining;
    reals[E1] = q[2];
    words[STATUS] = hi_status(t->arm, q);
    for (int i = 0; i < AXES; i++) turns |= (word)(q[i] < 0.0) << i;
    words[TURN] = turns;
}

/* A tick in position control of an arm that nothing pushes, whose load data are true: `Plant._compute` after its set-point.
   Returns DONE, or what is left: ELSEWHERE: all of it; LOADED: from the wrench on; STRAINED: from the supervision of the
   drives on. */
word ht_tick(struct tick *t, word tick, double progress, double remaining) {
    double slip[AXES];
    for (word i = 0; i < t->pulls; i++)
        if (t->pulled[i] != 0.0) return ELSEWHERE;
    t->step1(t->model, t->data);
    aim(t->gains, t->points, t->dq, slip, t->vector);
    t->multiply(t->model, t->data, t->product, t->vector); /* without forming the matrix, which is slower */
    copy(t->torque, t->product, AXES);
    feed_back(t->gains, t->points, t->q, t->bias, t->passive, slip, t->torque);
    ht_drive(t);
    t->step2(t->model, t->data);
    if (ht_sense(t)) return LOADED;
    for (int i = 0; i < 6; i++) t->wrench[i] = 0.0;
    if (t->ranges && ht_strained(t, 1)) return STRAINED;
    ht_write(t, tick, progress, remaining);
    return DONE;
}

/* Position in a motion, 0 to 1, at a place on its path: `Plan.progress`. */
static double progress(const struct tick *t, double place) {
    double part = (place - t->part_begin) / (t->part_end - t->part_begin);
    return part < 0.0 ? 0.0 : part > 1.0 ? 1.0 : part;
}

/* Let readers see the state that was written last. Returns whether one of them waits for it. */
word ht_publish(struct tick *t, word tick) {
    word *words = t->memory + STATES + tick % SLOTS * SIZE, *header = t->memory + HEADER;
    __atomic_store_n(words + SEQ, 2 * tick + 2, __ATOMIC_RELEASE);
    __atomic_store_n(header + NEWEST, tick, __ATOMIC_SEQ_CST);
    return tick * TICK_NS >= __atomic_load_n(header + WAKE_AT, __ATOMIC_SEQ_CST);
}

/* Puts the motion at its time, before `ht_follow`. */
void ht_put(struct tick *t, double time) { ha_put(t->table, &t->cursor, time); }

/* Ticks of a motion whose table decides about its set-points: until one of them has none or belongs to another part, one is not done
   in C, somebody waits for the state of one, or `count` are done. Returns how many are done and published; `left` is what is left of
   the next one, DONE if that has not begun. */
word ht_follow(struct tick *t, word tick, word count) {
    word done = 0;
    for (t->left = DONE, t->is_awaited = 0; done < count && !t->is_awaited; done++) {
        double there[AXES], *points = t->points;
        struct cursor next = t->cursor;
        if (!ha_next(t->table, &next, t->step, points + 2 * AXES, t->leap, there) || next.place >= t->mark) break;
        t->cursor = next;
        copy(points, points + AXES, 2 * AXES);
        copy(points + 2 * AXES, there, AXES);
        t->left = ht_tick(t, tick + done, progress(t, next.place), t->table->end - next.time);
        if (t->left != DONE) break;
        t->is_awaited = ht_publish(t, tick + done);
    }
    return done;
}
