/* One cycle of the FRI client: take a datagram, make its answer, publish what happened. No socket and no clock is used here.

   Theory of operation. One process per client, one thread in it, runs the cycle for every datagram; there are no locks. The
   user's process reads and writes the shared memory only: rings and notes whose sequence words a reader checks before and after
   it copies (odd: being written). So nothing that the user's program does can delay an answer, which has to be back within a
   part of the cabinet's cycle. Python starts this process, and is called only for a law in Python and to collect garbage while
   nothing arrives (fri_loop.c). Who calls what, in this order:

     fri_turn      one datagram: the session takes it (fri_session.c); then velocity, wrench, collision; then `follow` updates the
                   guards for the state of the session; then the answer, unless a law in Python has to be called first
     fri_answer    after a law in Python was called: its command through the guard, and the answer
     fri_finish    after the answer was sent: publish the state and the times

   What a cycle does depends on the controller's state, which the client only follows:

     IDLE, MONITORING_*   no commands; 1.x gets its commanded position back, as KUKA's client does
     COMMANDING_WAIT      the interpolator is mirrored; its velocity is noted. Commands and laws do not count yet
     COMMANDING_ACTIVE    the first message starts a guard from what was mirrored last (from the interpolator where the client came
                          later). Then every cycle: target by the law, or by the newest command and the policy; guard; answer
     any other -> ...     the guards stop; the next start is elsewhere, and `epoch` counts it: commands of an older one are not
                          executed (fri_commands.c)

   Lost messages are no lost time: the cabinet goes on meanwhile. After a short gap the skipped cycles are done evenly towards the
   target; after a long one the guard restarts from an estimate of the setpoint (fri_guard.c).

   Where a command comes from, the first that there is: a law; what the user's process wrote last, if it is of this `epoch` and
   young enough; otherwise the policy for missing commands (hold, or go on and brake). Each passes the same guard, which alone
   decides what is sent: it limits, and never refuses, since an answer is due in any case. What it limited is counted, and
   reported where a user sees it.

   Everything that a datagram changes is changed before its answer, and published after it was sent: an answer waits for no
   bookkeeping, and a reader sees a cycle either whole or not at all.

   `is_ending` ends all commands: a law that failed, a collision or the end of the client. Each cycle then brakes within the
   guard's limits, whatever else is commanded, and then holds the arm until the process ends.

   What enters a guard was checked when it was read (fri_session.c); the guard keeps its own numbers finite. No datagram can end
   the loop: it costs a cycle, or the session. */
#include <stdio.h>
#include <stdlib.h>

#include "fri.h"

enum { MAX_SKIPPED = 25 }; /* largest number of skipped cycles that are done after a short gap */

static const double zeros[AXES];

/* Publish with a release: readers check the sequence word. */
static word *open_slot(struct fri_loop *l) {
    word tick = l->header[H_STATES], *slot = l->seam->states + tick % l->seam->history * STATE_WORDS;
    __atomic_store_n(slot, 2 * tick + 1, __ATOMIC_RELAXED);
    __atomic_thread_fence(__ATOMIC_RELEASE);
    return slot;
}

static double *joints(struct fri_loop *l, int array) { return l->message->joints[PLACE_OF(array)]; }

static int knows(const struct fri_loop *l, int array) { return (l->message->known & BIT_OF(array)) != 0; }

static int is_commanding(const struct fri_loop *l) { return l->session.state == COMMANDING_ACTIVE; }

static int commands_joints(const struct fri_loop *l) {
    return l->session.mode == POSITION || l->session.mode == TORQUE || l->session.mode == WRENCH;
}

static double command_period(const struct fri_loop *l) {
    double period = (double)(l->session.period * l->session.multiplier) * 1e-9;
    return period > 0.0 ? period : 1e-3;
}

/* FRI's x y z [mm], quaternion w x y z, and x y z [m], x y z w. */
static void from_wire(const double *values, double *pose) {
    double w = values[3];
    for (int i = 0; i < 3; i++) pose[i] = 1e-3 * values[i];
    memmove(pose + 3, values + 4, 24);
    pose[6] = w;
}

static void to_wire(const double *pose, double *values) {
    for (int i = 0; i < 3; i++) values[i] = 1e3 * pose[i];
    values[3] = pose[6];
    memcpy(values + 4, pose + 3, 24);
}

/* ----------------------------------------------------------------------------------------------------------- life */

/* Make a loop on the shared memory and the settings of a seam, which Python keeps. */
struct fri_loop *fri_new(struct fri_seam *seam) {
    struct fri_loop *l = calloc(1, sizeof *l);
    if (!l) return NULL;
    l->seam = seam;
    l->header = seam->header;
    l->message = l->messages;
    l->guard.limits = seam->joint_limits;
    l->pose_guard.limits = seam->pose_limits;
    l->pose_guard.quat[3] = l->pose_guard.goal_quat[3] = 1.0;
    l->guard.report = (struct limit_report){l->header + H_LIMITED_COUNTS, (double *)l->header + H_LIMITED_WORST, (double *)l->header + H_LIMITED_ALLOWED};
    l->pose_guard.report = (struct limit_report){l->header + H_POSE_COUNTS, (double *)l->header + H_POSE_WORST, (double *)l->header + H_POSE_ALLOWED};
    l->commands_seen = l->header[H_COMMANDS];
    l->exchange.outputs_seen = *seam->outputs;
    fri_session_restart(&l->session);
    l->began = l->session.began;
    l->pose_ipo_e1 = l->pose_guard.e1 = NAN;
    fri_set_trouble(l, "no message received from a controller yet");
    seam->reply = (word *)l->reply;
    return l;
}

void fri_free(struct fri_loop *l) { free(l); }

/* Brake from now on, regardless of commands. */
void fri_end(struct fri_loop *l) { l->is_ending = 1; }

/* Whether no axis moves by commands of this client. */
int fri_may_end(const struct fri_loop *l) {
    return (!l->guard.is_started || joint_guard_is_still(&l->guard)) && (!l->pose_guard.is_started || pose_guard_is_still(&l->pose_guard));
}

/* Publish an event whose text Python has. */
void fri_note(struct fri_loop *l, word kind, word now, const char *text) { fri_report(l, kind, now, "%s", text); }

static void forget_pose(struct fri_loop *l) {
    l->has_pose = l->is_pose_mirrored = 0;
    l->pose_ipo_e1 = NAN;
}

/* Reset for another controller: its counter, version and interpolator are not those of the last one. */
void fri_forget_controller(struct fri_loop *l) {
    fri_session_restart(&l->session);
    fri_set_trouble(l, "no message received from a controller yet");
    l->guard.is_started = l->pose_guard.is_started = l->is_mirrored = l->q_known = 0;
    l->reach_from = 0;
    forget_pose(l);
}

/* ----------------------------------------------------------------------------------------------- what a message says */

/* Velocity by the difference to the previous message; `leap` is the increment of the counter. */
static void differentiate(struct fri_loop *l, word leap) {
    double gap = (double)(leap * l->session.period) * 1e-9;
    int known = knows(l, S_Q), is_next = l->q_known && 0 < leap && leap <= MAX_LOST && gap > 0.0;
    for (int i = 0; i < AXES; i++) {
        double q = joints(l, S_Q)[i];
        l->dq[i] = !known ? NAN : is_next ? (q - l->q_before[i]) / gap : 0.0;
        if (known) l->q_before[i] = q;
    }
    l->q_known = known;
}

/* Take the external wrench of a message, or estimate it from the torques where the controller sends none. */
static void find_wrench(struct fri_loop *l) {
    struct wrench_map map;
    if (l->has_wrench) return;
    l->has_wrench = 1;
    for (int i = 0; i < 6; i++) l->wrench[i] = isnan(l->message->wrench[0]) ? NAN : l->message->wrench[i];
    if (!isnan(l->message->wrench[0]) || !l->seam->has_chain || !knows(l, S_Q) || !knows(l, S_TAU_EXT)) return;
    if (!map_wrenches((const struct chain *)l->seam->chain, joints(l, S_Q), &map)) return;
    explain_torques(&map, joints(l, S_TAU_EXT), l->wrench);
    l->flags |= ESTIMATED;
}

/* Brake from now on if the external torque of a joint is outside its band while commands are effective. */
static void detect_collision(struct fri_loop *l) {
    const struct fri_seam *seam = l->seam;
    double worst = 0.0, torque = NAN, allowed = seam->watch_threshold[0];
    int joint = knows(l, S_TAU_EXT) ? -1 : 0;
    if (!seam->has_watch || l->is_ending || !is_commanding(l)) return;
    for (int i = 0; i < AXES && knows(l, S_TAU_EXT); i++) {
        double speed = isnan(l->dq[i]) ? 0.0 : fabs(l->dq[i]), band = seam->watch_threshold[i] + seam->watch_margin[i] * speed;
        double off = joints(l, S_TAU_EXT)[i] - seam->watch_baseline[i], over = fabs(off) - band;
        if (over <= worst) continue;
        worst = over, torque = off, allowed = band, joint = i; /* also a torque that is not a number */
        if (isnan(over)) break;
    }
    if (joint < 0) return;
    double *floats = (double *)l->header;
    floats[H_COLLISION_TORQUE] = torque;
    floats[H_COLLISION_ALLOWED] = allowed;
    __atomic_store_n(&l->header[H_COLLIDED], 1 + joint, __ATOMIC_RELEASE); /* last: a reader then finds the others */
    if (knows(l, S_TAU_EXT))
        fri_report(l, KIND_CLIENT, l->session.received, COLLIDED "A%d: %+.1f Nm external torque, allowed are %.1f Nm", joint + 1, torque, allowed);
    else
        fri_report(l, KIND_CLIENT, l->session.received, COLLIDED "the controller sends no external torques");
    fri_end(l);
}

/* ------------------------------------------------------------------------------------- guards by the session's state */

/* Duration of a gap in the messages, by the controller's counter [s]; 0 if it is short. */
static double gap_of(const struct fri_loop *l, word leap, word elapsed, double period) {
    double time = 0 < leap && leap <= MAX_LOST ? (double)(leap * l->session.period) : (double)elapsed;
    return time > most(GAP_PERIODS * period * 1e9, MIN_GAP) ? time * 1e-9 : 0.0;
}

/* Restart the joint guard after a gap, from the estimated positions and velocities. */
static void resume_joints(struct fri_loop *l, double time, double period) {
    double q[AXES], dq[AXES], unknown[AXES] = {NAN, NAN, NAN, NAN, NAN, NAN, NAN};
    const double *then = unknown, *now = unknown;
    int is_exact = 1;
    if (knows(l, S_Q_CMD) && l->then_has_q_cmd) {
        then = l->then_q_cmd, now = joints(l, S_Q_CMD);
    } else if (knows(l, S_Q) && l->then_has_q) { /* a compliant arm may deviate permanently from its setpoint */
        then = l->then_q, now = joints(l, S_Q);
        is_exact = l->message->control == POSITION_CONTROL;
    }
    l->guard.period = period;
    joints_after_gap(&l->guard, then, now, time, is_exact, q, dq);
    joint_guard_start(&l->guard, q, dq, period);
}

/* Restart the pose guard after a gap, from the estimated pose and velocity. */
static void resume_pose(struct fri_loop *l, double time, double period) {
    struct pose_guard *g = &l->pose_guard;
    const struct message *m = l->message;
    double displacement[6] = {0}, speed[6], twist[6], sent[7], before[7], pose[7], back[6], change = 0.0;
    if (m->has_monitored_pose && l->then_has_pose) {
        from_wire(m->pose, pose);
        pose_between(l->then_pose, pose, displacement);
        if (m->has_monitored_redundancy && isfinite(l->then_e1)) change = m->e1 - l->then_e1;
    }
    for (int i = 0; i < 3; i++) {
        speed[i] = g->v[i] / period, speed[3 + i] = g->w[i] / period;
        back[i] = -g->v[i], back[3 + i] = -g->w[i];
    }
    vector_in_gap(speed, displacement, time, twist);
    vector_in_gap(speed + 3, displacement + 3, time, twist + 3);
    double e1_speed = motion_in_gap(g->u / period, &change, time);
    memcpy(sent, g->xyz, sizeof g->xyz);
    memcpy(sent + 3, g->quat, sizeof g->quat);
    pose_moved(sent, back, before);
    pose_moved(before, displacement, pose);
    pose_guard_start(g, pose, twist, period, g->e1 - g->u + change, e1_speed);
}

/* Read pose and redundancy of the interpolator. */
static void update_pose(struct fri_loop *l) {
    if (!l->message->ipo_pose.is_given) return;
    l->has_pose = 1;
    l->ipo_pose = l->message->ipo_pose;
    l->ipo_strategy = l->message->ipo_strategy;
    l->ipo_e1 = l->message->ipo_e1;
    from_wire(l->ipo_pose.values, l->pose_ipo);
    l->pose_ipo_e1 = l->ipo_strategy == E1 ? l->message->ipo_e1 : NAN;
}

/* Note that a pose of the interpolator is mirrored, and how fast it moves. */
static void mirror_pose(struct fri_loop *l) {
    if (!l->has_pose) return;
    double gap = (double)((l->session.sequence - l->pose_sequence) * l->session.period) * 1e-9;
    memset(l->twist, 0, sizeof l->twist);
    l->e1_rate = 0.0;
    if (l->is_pose_mirrored && gap > 0.0) {
        pose_between(l->mirrored_pose, l->pose_ipo, l->twist);
        for (int i = 0; i < 6; i++) l->twist[i] /= gap;
        double rate = (l->pose_ipo_e1 - l->mirrored_e1) / gap;
        l->e1_rate = isfinite(rate) ? rate : 0.0;
    }
    memcpy(l->mirrored_pose, l->pose_ipo, sizeof l->pose_ipo);
    l->mirrored_e1 = l->pose_ipo_e1;
    l->is_pose_mirrored = 1;
    l->pose_sequence = l->session.sequence;
}

static void mirror_joints(struct fri_loop *l) {
    double gap = (double)((l->session.sequence - l->mirrored_sequence) * l->session.period) * 1e-9;
    for (int i = 0; i < AXES; i++) {
        l->slope[i] = l->is_mirrored && gap > 0.0 ? (joints(l, S_Q_IPO)[i] - l->mirrored[i]) / gap : 0.0;
        l->mirrored[i] = joints(l, S_Q_IPO)[i];
    }
    l->is_mirrored = 1;
    l->mirrored_sequence = l->session.sequence;
}

/* Start a guard when commands become effective; it does not start without a position (a pose) of the interpolator. */
static void start(struct fri_loop *l, int by_pose, int again, double period) {
    static const double at_rest[AXES];
    if (by_pose && l->is_pose_mirrored && !again)
        pose_guard_start(&l->pose_guard, l->mirrored_pose, l->twist, period, l->mirrored_e1, l->e1_rate);
    else if (by_pose && l->has_pose) /* the client connected after commanding had started */
        pose_guard_start(&l->pose_guard, l->pose_ipo, at_rest, period, l->pose_ipo_e1, 0.0);
    else if (!by_pose && l->is_mirrored && !again)
        joint_guard_start(&l->guard, l->mirrored, l->slope, period);
    else if (!by_pose && knows(l, S_Q_IPO))
        joint_guard_start(&l->guard, joints(l, S_Q_IPO), at_rest, period);
    l->is_pose_mirrored = 0;
    fri_start_torque_guard((struct torque_guard *)l->seam->torque_guard);
    fri_commands_start(&l->commands);
    l->ticks = -1;
    l->commands_seen = l->header[H_COMMANDS] > 0 ? l->header[H_COMMANDS] - 1 : 0; /* one given just before the start counts */
    l->started = l->session.received;
}

/* Go on with another period: the limits are per step. A session that began unseen may have another one. */
static void rescale(struct fri_loop *l, double period) {
    double q[AXES], dq[AXES];
    for (int i = 0; i < AXES; i++) q[i] = l->guard.q[i], dq[i] = l->guard.v[i] / l->guard.period;
    joint_guard_start(&l->guard, q, dq, period);
}

/* Update guards and policy for the state of the session; `leap` is the increment of the controller's counter, `elapsed` the time
   since the message before. */
static void follow(struct fri_loop *l, word leap, word elapsed) {
    struct session *s = &l->session;
    word step = 0 < leap && leap <= MAX_LOST ? leap : 1;
    int by_pose = s->mode == CARTESIAN_POSE, again = s->began != l->began, commands = s->state >= COMMANDING_WAIT;
    if (by_pose) {
        update_pose(l);
    } else if (l->has_pose) {
        l->pose_guard.is_started = 0;
        forget_pose(l);
    }
    if (commands && (again || !l->commanded)) {
        l->epoch++;
        l->is_stale = 0;
    }
    l->commanded = commands;
    l->began = s->began;
    l->skipped = 0;
    if (again || !is_commanding(l)) l->guard.is_started = l->pose_guard.is_started = 0;
    l->reach_from = s->state == COMMANDING_WAIT && knows(l, S_Q_IPO) ? s->received : 0;
    if (l->reach_from) memcpy(l->reach_ipo, joints(l, S_Q_IPO), sizeof l->reach_ipo);
    if (is_commanding(l)) {
        double period = command_period(l), gap = gap_of(l, leap, elapsed, period);
        if (!(by_pose ? l->pose_guard.is_started : l->guard.is_started)) {
            start(l, by_pose, again, period);
            step = 1;
        } else if (gap > 0.0) {
            (by_pose ? resume_pose : resume_joints)(l, gap, period);
        } else {
            l->skipped = (step - 1) / s->multiplier;
            if (!by_pose && l->guard.period != period) rescale(l, period);
        }
        l->ticks += step; /* the controller's time advances while messages are lost */
        l->is_mirrored = 0;
    } else if (s->state == COMMANDING_WAIT && by_pose) {
        mirror_pose(l);
    } else if (s->state == COMMANDING_WAIT && knows(l, S_Q_IPO)) {
        mirror_joints(l);
    } else {
        l->is_mirrored = 0;
        forget_pose(l);
    }
}

/* -------------------------------------------------------------------------------------------------------- publishing */

static void put(double *into, const double *values, int size, int is_known) {
    for (int i = 0; i < size; i++) into[i] = is_known ? values[i] : NAN;
}

static void fill_state(struct fri_loop *l, word *slot, word latency) {
    const struct session *s = &l->session;
    const struct message *m = l->message;
    double numbers[STATE_WORDS];
    int active = is_commanding(l), has_pose = fri_has_quaternions(s->version), posed = l->sent_mode == CARTESIAN_POSE;
    slot[S_RECEIVED] = s->received;
    slot[S_SEQUENCE] = s->sequence;
    slot[S_STAMP] = m->stamp == ABSENT ? 0 : m->stamp;
    slot[S_SESSION] = s->state;
    slot[S_QUALITY] = s->quality;
    slot[S_MODE] = s->mode;
    slot[S_OVERLAY] = m->overlay;
    slot[S_SAFETY] = m->safety;
    slot[S_OPERATION] = m->operation;
    slot[S_CONTROL] = m->control;
    slot[S_DRIVE] = m->drive;
    slot[S_PERIOD] = s->period;
    slot[S_MULTIPLIER] = m->multiplier;
    slot[S_LATENCY] = latency;
    slot[S_FLAGS] = l->flags;
    slot[S_REFLECTED] = s->reflected;
    slot[S_SENT] = s->sent;
    slot[S_TICKS] = active && l->ticks > 0 ? l->ticks : 0;
    slot[S_STRATEGY] = has_pose ? m->strategy : ABSENT;
    numbers[S_TRACKING] = m->tracking;
    for (int array = 0; array < MESSAGE_ARRAYS; array++) put(numbers + S_ARRAYS + AXES * array, m->joints[array], AXES, m->known >> array & 1);
    put(numbers + S_WRENCH, l->wrench, 6, l->has_wrench);
    put(numbers + S_POSE, m->pose, AXES, has_pose && m->has_monitored_pose);
    numbers[S_E1] = has_pose ? m->e1 : NAN;
    put(numbers + S_Q_SENT, l->guard.q, AXES, l->sent_mode != ABSENT && !posed);
    put(numbers + S_TAU_SENT, l->guard.tau_sent, AXES, l->sent_mode == TORQUE);
    put(numbers + S_WRENCH_SENT, l->guard.wrench_sent, 6, l->sent_mode == WRENCH);
    put(numbers + S_POSE_IPO, l->ipo_pose.values, AXES, active && l->has_pose);
    put(numbers + S_POSE_SENT, l->pose_sent, AXES, posed);
    numbers[S_E1_IPO] = active ? l->pose_ipo_e1 : NAN;
    numbers[S_E1_SENT] = posed ? l->e1_sent : NAN;
    for (int i = 0; i < MAX_IO; i++) {
        numbers[S_IO + i] = i < m->signals ? (double)(uint64_t)m->signal[i].bits : NAN;
        if (i < m->signals && m->signal[i].type == ANALOG) memcpy(numbers + S_IO + i, &m->signal[i].bits, 8);
    }
    memcpy(slot + S_TRACKING, numbers + S_TRACKING, sizeof numbers - 8 * S_TRACKING);
}

/* Keep what the estimate after a gap needs of this message. */
static void keep(struct fri_loop *l) {
    l->then_has_q = knows(l, S_Q);
    l->then_has_q_cmd = knows(l, S_Q_CMD);
    memcpy(l->then_q, joints(l, S_Q), sizeof l->then_q);
    memcpy(l->then_q_cmd, joints(l, S_Q_CMD), sizeof l->then_q_cmd);
    l->then_has_pose = l->message->has_monitored_pose;
    if (l->then_has_pose) from_wire(l->message->pose, l->then_pose);
    l->then_e1 = l->message->e1;
}

/* Publish the turn; its answer was sent at `now`. */
void fri_finish(struct fri_loop *l, word now) {
    if (l->answered) {
        l->flags |= ANSWERED;
        fri_count_latency(l, now);
    }
    if (l->is_fresh) {
        word tick = l->header[H_STATES], *slot = open_slot(l);
        find_wrench(l);
        fill_state(l, slot, l->answered ? now - l->session.received : 0);
        __atomic_store_n(slot, 2 * tick + 2, __ATOMIC_RELEASE);
        __atomic_store_n(&l->header[H_STATES], tick + 1, __ATOMIC_RELEASE);
        __atomic_store_n(&l->header[H_EPOCH], l->epoch, __ATOMIC_RELEASE); /* last: who reads it then finds a state of it */
        keep(l);
        l->is_fresh = 0;
    }
    l->header[H_BEAT] = now;
}

/* --------------------------------------------------------------------------------------------------------- answering */

/* Send an answer; without joints and pose it mirrors, or has outputs and frames only. */
static int write_answer(struct fri_loop *l, struct answer *a) {
    struct session *s = &l->session;
    a->sent = s->sent;
    a->reflected = s->sequence;
    a->exchange = l->encoded;
    a->exchange_size = 0;
    if (l->exchange.pending || l->exchange.frames) a->exchange_size = fri_exchange_put(l, l->encoded);
    int size = fri_encode(a, s->version, l->reply);
    if (size > MAX_DATAGRAM) {
        fri_report(l, KIND_CLIENT, s->received, "an FRI datagram must have at most %d bytes, got %d: use fewer or shorter IO names and transformations",
                   MAX_DATAGRAM, size);
        l->exchange.pending = a->exchange_size = 0;
        size = fri_encode(a, s->version, l->reply);
    }
    s->sent = (s->sent + 1) & 0xffffffff;
    s->waiting = s->is_due = 0;
    l->header[H_COUNTS + COUNT_ANSWERED]++;
    l->header[H_COUNTS + COUNT_COMMANDED] += is_commanding(l);
    l->answered = 1;
    return size;
}

/* The answer that commands nothing: what was sent comes back. */
static int mirror(struct fri_loop *l) {
    struct answer a = {.strategy = ABSENT};
    word state = l->session.state, mode = l->session.mode;
    const char *missing = NULL;
    if (state == MONITORING_WAIT || state == MONITORING_READY) {
        a.q = !fri_has_quaternions(l->session.version) && knows(l, S_Q_CMD) ? joints(l, S_Q_CMD) : NULL;
    } else if (mode == CARTESIAN_POSE && l->message->ipo_pose.is_given) {
        a.pose = &l->message->ipo_pose;
        a.pose_values = a.pose->values;
        a.strategy = l->message->ipo_strategy;
        a.e1 = l->message->ipo_e1;
    } else if (mode == CARTESIAN_POSE) {
        missing = "the controller sends no interpolator pose to mirror";
    } else if (mode != NO_COMMAND && knows(l, S_Q_IPO)) {
        a.q = joints(l, S_Q_IPO);
        a.tau = mode == TORQUE ? zeros : NULL;
        a.wrench = mode == WRENCH ? zeros : NULL;
    } else if (mode != NO_COMMAND) {
        missing = "the controller sends no interpolator position to mirror";
    }
    int size = write_answer(l, &a); /* reports outputs that are gone */
    if (missing) fri_report(l, KIND_NO_IPO, l->session.received, "%s", missing);
    return size;
}

static void count_setpoint(struct fri_loop *l, int is_limited) {
    l->flags |= is_limited ? LIMITED : 0;
    l->header[H_COUNTS + COUNT_LIMITED] += is_limited;
    l->header[H_COUNTS + COUNT_FILLED] += (l->flags & FILLED) != 0;
}

/* Limit a target and answer; without one the axes brake. Skipped cycles are done first, evenly towards the target: the cabinet has
   moved on in the meantime, and otherwise the next setpoint would lie behind the arm. */
static int command_joints(struct fri_loop *l, const double *target, const double *tau, const double *wrench) {
    struct joint_guard *g = &l->guard;
    word mode = l->session.mode, steps = (l->skipped < MAX_SKIPPED ? l->skipped : MAX_SKIPPED) + 1;
    const double *reach = isinf(g->limits.reach) ? NULL : joints(l, S_Q_IPO);
    double before[AXES], step[AXES];
    int is_limited = 0;
    if (!target) l->flags |= BRAKING;
    memcpy(before, g->r, sizeof before);
    for (word k = 1; k < steps; k++) {
        for (int i = 0; i < AXES && target; i++) step[i] = before[i] + (target[i] - before[i]) * (double)k / (double)steps;
        joint_guard_position(g, target ? step : NULL, reach);
        is_limited |= g->was_limited;
    }
    joint_guard_position(g, target, reach);
    struct torque_guard *motion = (struct torque_guard *)l->seam->torque_guard;
    static const double unknown[AXES] = {NAN, NAN, NAN, NAN, NAN, NAN, NAN};
    const double *here = knows(l, S_Q) ? joints(l, S_Q) : unknown;
    if (mode == TORQUE) joint_guard_torque(g, tau, motion, here, l->dq, !target);
    if (mode == WRENCH) joint_guard_force(g, wrench, motion, here, l->dq, !target);
    g->was_limited |= is_limited;
    l->sent_mode = mode;
    count_setpoint(l, g->was_limited);
    struct answer a = {.q = g->q, .tau = mode == TORQUE ? g->tau_sent : NULL, .wrench = mode == WRENCH ? g->wrench_sent : NULL, .strategy = ABSENT};
    return write_answer(l, &a);
}

static int command_pose(struct fri_loop *l, const double *target, const double *e1) {
    struct pose_guard *g = &l->pose_guard;
    word steps = (l->skipped < MAX_SKIPPED ? l->skipped : MAX_SKIPPED) + 1;
    const double *reach = isinf(g->limits.reach) ? NULL : l->pose_ipo;
    double from[7], displacement[6], part[6], step[7], sent[7];
    int is_limited = 0;
    if (!target) l->flags |= BRAKING;
    memcpy(from, g->goal_xyz, sizeof g->goal_xyz);
    memcpy(from + 3, g->goal_quat, sizeof g->goal_quat);
    if (steps > 1 && target) pose_between(from, target, displacement);
    for (word k = 1; k < steps; k++) {
        for (int i = 0; i < 6 && target; i++) part[i] = (double)k / (double)steps * displacement[i];
        if (target) pose_moved(from, part, step);
        pose_guard_pose(g, target ? step : NULL, reach, sent);
        is_limited |= g->was_limited;
    }
    pose_guard_pose(g, target, reach, sent);
    g->was_limited |= is_limited;
    to_wire(sent, l->pose_sent);
    struct answer a = {.pose = &l->ipo_pose, .pose_values = l->pose_sent, .strategy = l->ipo_strategy, .e1 = l->ipo_e1};
    if (l->ipo_strategy != ABSENT && !isnan(g->e1)) {
        a.strategy = E1;
        a.e1 = pose_guard_elbow(g, e1);
    }
    l->e1_sent = a.strategy == ABSENT ? NAN : a.e1;
    l->sent_mode = CARTESIAN_POSE;
    count_setpoint(l, g->was_limited);
    return write_answer(l, &a);
}

/* Make the answer after the law was called, or brake. */
int fri_answer(struct fri_loop *l) {
    const struct heptarm_command *out = &l->seam->out;
    if (l->seam->written && !l->is_ending) fri_exchange_write(l);
    if (commands_joints(l)) return l->is_ending ? command_joints(l, NULL, zeros, zeros) : command_joints(l, out->q, out->tau, out->wrench);
    return l->is_ending ? command_pose(l, NULL, NULL) : command_pose(l, out->pose, &out->e1);
}

/* The external wrench that explains torques, for Python; NaN where there is none. */
void fri_wrench(const double *chain, const double *q, const double *tau, double *wrench) {
    struct wrench_map map;
    if (map_wrenches((const struct chain *)chain, q, &map))
        explain_torques(&map, tau, wrench);
    else
        for (int i = 0; i < 6; i++) wrench[i] = NAN;
}

/* Prepare the output of the law, and the state that it sees. */
static word *prepare_law(struct fri_loop *l) {
    struct heptarm_command *out = &l->seam->out;
    word *slot = open_slot(l);
    memset(out, 0, sizeof *out);
    put(out->q, joints(l, S_Q_IPO), AXES, knows(l, S_Q_IPO));
    put(out->pose, l->pose_ipo, AXES, l->has_pose);
    out->e1 = l->pose_ipo_e1;
    l->seam->written = 0;
    l->seam->received = l->session.received;
    memcpy(l->seam->dq, l->dq, sizeof l->dq);
    find_wrench(l);
    fill_state(l, slot, 0);
    return slot;
}

/* Answer by the newest command of the user's process and the policy. */
static int follow_command(struct fri_loop *l) {
    double buffer[AXES], tau[AXES], wrench[6];
    fri_take_command(l);
    if (commands_joints(l)) {
        const double *target = fri_position_target(l, joints(l, S_Q_IPO), buffer);
        l->flags |= l->commands.is_filled ? FILLED : 0;
        fri_efforts(l, tau, wrench);
        return command_joints(l, target, tau, wrench);
    }
    const double *target = fri_pose_target(l, l->pose_ipo, buffer);
    l->flags |= l->commands.is_filled ? FILLED : 0;
    return command_pose(l, target, l->commands.is_braking ? NULL : l->commands.has_e1 ? &l->commands.e1 : &l->pose_ipo_e1);
}

/* Process a datagram: LAW (call the law in Python and then fri_answer), or the size of the answer, 0 for none. */
int fri_turn(struct fri_loop *l, const uint8_t *data, int size, word received) {
    word before = l->session.received, previous = l->session.has_message ? l->session.sequence : 0;
    l->flags = 0;
    l->answered = l->is_fresh = l->has_wrench = 0;
    l->sent_mode = ABSENT;
    if (!fri_receive(l, data, size, received)) return 0;
    l->is_fresh = 1;
    word leap = l->session.sequence - previous;
    differentiate(l, leap);
    fri_exchange_update(l);
    detect_collision(l);
    follow(l, leap, received - before);
    if (!l->session.is_due) return 0;
    fri_exchange_take(l);
    int by_joints = commands_joints(l) && l->guard.is_started && knows(l, S_Q_IPO);
    int by_pose = l->session.mode == CARTESIAN_POSE && l->pose_guard.is_started;
    if (!is_commanding(l) || !(by_joints || by_pose)) return mirror(l);
    if (l->is_ending || !l->seam->has_law) return l->is_ending ? fri_answer(l) : follow_command(l);
    word *slot = prepare_law(l);
    if (!l->seam->law) return LAW;
    if (fri_law(l, slot) != LAW_OK) fri_end(l);
    return fri_answer(l);
}
