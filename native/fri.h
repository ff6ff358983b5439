/* What the files of the FRI client share: messages, guards, commands of the user, session, and the loop that holds them.

   fri_layout.h is generated from tables of Python modules: constants, the layout of the shared memory, and the structures that
   Python fills: limits, settings, and `struct fri_seam`. */
#ifndef HEPTARM_FRI_H
#define HEPTARM_FRI_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "heptarm_law.h"
#include "kinematics.h"
#include "limited_steps.h"

/* Sizes of buffers: a datagram, all outputs and frames of an answer, an answer; and of a text. */
enum { BUFFER = 2048, EXCHANGE = 5120, REPLY = 6144, TEXT = 400, NUMBERS_OF_A_FRAME = 12 };

/* ------------------------------------------------------------------------------------------------- fri_message.c */

struct name {
    int size;
    uint8_t bytes[NAME_BYTES];
};

struct time_stamp {
    int is_given;
    uint32_t seconds, nanos;
};

struct io_value {
    struct name name;
    int type, direction;
    word bits; /* of a double where the type is ANALOG */
};

struct requested_frame {
    struct name name;
    struct time_stamp stamp;
};

/* A pose of the interpolator as it was sent, so that it can be sent back. */
struct wire_pose {
    int is_given;
    struct name name;
    double values[7]; /* x y z [mm], quaternion w x y z */
    struct time_stamp stamp;
};

enum { MESSAGE_ARRAYS = (S_WRENCH - S_ARRAYS) / AXES, MAX_LOST = 1000 }; /* a larger jump of the counter is a change of it */
/* Place of an array of a state among those of a message, and its bit in `known`. */
#define PLACE_OF(array) (((array) - S_ARRAYS) / AXES)
#define BIT_OF(array) (1u << PLACE_OF(array))

/* A monitoring message; numbers that it lacks are ABSENT, doubles NaN. */
struct message {
    word sequence, reflected;
    int has_link; /* connection info */
    word state, quality, period_ms, multiplier;
    word safety, drive, operation, control;
    unsigned known; /* which joint arrays it has */
    double joints[MESSAGE_ARRAYS][AXES];
    double wrench[6], pose[7]; /* pose as on the wire */
    word strategy, stamp;
    double e1;
    word mode, overlay;
    double tracking;
    struct wire_pose ipo_pose;
    word ipo_strategy;
    double ipo_e1;
    int has_monitored_pose, has_monitored_redundancy;
    int signals, requests;
    struct io_value signal[MAX_IO];
    struct requested_frame request[MAX_TRANSFORMATIONS];
    char why[TEXT]; /* why it is no legal message */
};

/* What an answer commands; parts that are NULL are not sent. */
struct answer {
    word sent, reflected;
    const double *q, *tau, *wrench;
    const struct wire_pose *pose;
    const double *pose_values; /* in place of those of `pose` */
    word strategy;             /* ABSENT: no redundancy */
    double e1;
    const uint8_t *exchange; /* frames and outputs, encoded */
    int exchange_size;
};

int fri_decode(const uint8_t *data, int size, int version, struct message *m);
int fri_recognise(const uint8_t *data, int size, char *why);
int fri_encode(const struct answer *a, int version, uint8_t *into);
int fri_put_output(const struct io_value *signal, word bits, uint8_t *into);
int fri_put_frame(const struct name *name, const double *values, int count, const struct time_stamp *stamp, uint8_t *into);
int fri_same_name(const struct name *a, const struct name *b);
extern const char *const fri_version_names[];
int fri_is_framed(int version);
int fri_has_quaternions(int version);

/* --------------------------------------------------------------------------------------------------- fri_guard.c */

/* Counts and extremes of what was limited, by kind and axis or part; in the shared memory. */
struct limit_report {
    word *counts;
    double *worst, *allowed;
};

struct joint_guard {
    struct joint_limits limits;
    struct limit_report report;
    double period, coast; /* command period [s]; steps that the cabinet may go on without a command */
    double q[AXES], v[AXES], a[AXES], r[AXES], tau[AXES], wrench[6]; /* sent last; its differences; last target */
    double tau_sent[AXES], wrench_sent[6]; /* of `tau` and `wrench` what the guard of the motion lets through */
    double low[AXES], high[AXES], top_v[AXES], top_a[AXES], top_j[AXES], near[AXES];
    int is_started, was_limited;
};

void joint_guard_start(struct joint_guard *g, const double *q, const double *dq, double period);
void joint_guard_position(struct joint_guard *g, const double *target, const double *ipo);
struct torque_guard;
void joint_guard_torque(struct joint_guard *g, const double *target, struct torque_guard *motion, const double *q, const double *dq, int is_braking);
void fri_start_torque_guard(struct torque_guard *guard);
void joint_guard_force(struct joint_guard *g, const double *target, struct torque_guard *motion, const double *q, const double *dq, int is_braking);
int joint_guard_is_still(const struct joint_guard *g);

struct pose_guard {
    struct pose_limits limits;
    struct limit_report report;
    double period, top[3], most[3];
    double xyz[3], quat[4], goal_xyz[3], goal_quat[4], v[3], w[3];
    double e1, u, e1_goal;
    int is_started, was_limited;
};

void pose_guard_start(struct pose_guard *g, const double *pose, const double *twist, double period, double e1, double e1_speed);
void pose_guard_pose(struct pose_guard *g, const double *target, const double *ipo, double *sent);
double pose_guard_elbow(struct pose_guard *g, const double *target);
int pose_guard_is_still(const struct pose_guard *g);
void pose_between(const double *first, const double *second, double *displacement);
void pose_moved(const double *pose, const double *displacement, double *into);
void joints_after_gap(struct joint_guard *g, const double *then, const double *now, double time, int is_exact, double *q, double *dq);
double motion_in_gap(double speed, double *distance, double time);
void vector_in_gap(const double *speed, double *displacement, double time, double *velocity);

/* ------------------------------------------------------------------------------------------------ fri_commands.c */

/* The last command of the user's process, and what follows from it in every cycle. */
struct commands {
    word at; /* time of the last command [ns]; 0: there was none */
    int has_q, has_slope, has_tau, has_wrench, has_pose, has_twist, has_e1;
    double q[AXES], slope[AXES], tau[AXES], wrench[6], pose[7], twist[6], e1;
    int is_filled, is_braking;
};

/* ------------------------------------------------------------------------------------------------- fri_session.c */

struct session {
    int version; /* of the controller; ABSENT: not known */
    int has_message, is_due;
    word state, quality, mode, safety;
    word sequence, period, multiplier, received, waiting, sent, reflected;
    word began; /* the counter's restarts and new controllers so far */
    char trouble[TEXT];
};

/* Outputs to be written and frames to be sent, and what the session offers. */
struct exchange {
    word outputs_seen, taken; /* tick of the note that was read; count of the newest output taken */
    int pending;
    struct pending_output {
        struct name name;
        int is_analog;
        word bits, left;
    } output[MAX_IO];
    int frames;
    struct given_frame {
        struct name name;
        double pose[7];
        struct time_stamp stamp;
    } frame[MAX_TRANSFORMATIONS];
    word offered; /* hash of the names that were published */
};

/* ---------------------------------------------------------------------------------- fri_cycle.c, fri_loop.c: all */

struct fri_loop {
    struct fri_seam *seam;
    word *header; /* the shared memory from its beginning */
    struct session session;
    struct message messages[2], *message; /* the newest one; the other is read into */
    struct joint_guard guard;
    struct pose_guard pose_guard;
    struct commands commands;
    struct exchange exchange;
    int is_ending;
    /* commanding: sessions seen so far; number of the present one; whether commands counted in the last message */
    word began, epoch, started, commands_seen, ticks, skipped;
    int commanded, is_stale;
    /* this cycle */
    word flags, sent_mode; /* what was commanded; ABSENT: nothing */
    int answered, is_fresh, has_wrench;
    double wrench[6], dq[AXES], pose_sent[7], e1_sent;
    /* the message before: velocity, estimate after a gap, reach of the interpolator */
    int q_known, then_has_q, then_has_q_cmd, then_has_pose;
    double q_before[AXES], then_q[AXES], then_q_cmd[AXES], then_pose[7], then_e1, reach_ipo[AXES];
    word reach_from; /* time of reach_ipo; 0: there is none */
    /* the interpolator in COMMANDING_WAIT: where it was last, and how fast */
    int is_mirrored, is_pose_mirrored;
    word mirrored_sequence, pose_sequence;
    double mirrored[AXES], slope[AXES], mirrored_pose[7], mirrored_e1, twist[6], e1_rate;
    /* the interpolator's pose in a session that commands poses */
    int has_pose;
    struct wire_pose ipo_pose;
    word ipo_strategy;
    double ipo_e1, pose_ipo[7], pose_ipo_e1;
    /* the socket */
    uint32_t peer;
    int peer_port;
    word braking_until, checked;
    uint8_t datagram[BUFFER], encoded[EXCHANGE], reply[REPLY];
};

void fri_report(struct fri_loop *l, word kind, word now, const char *format, ...) __attribute__((format(printf, 4, 5)));
void fri_set_trouble(struct fri_loop *l, const char *text);
void fri_session_restart(struct session *s);
int fri_receive(struct fri_loop *l, const uint8_t *data, int size, word now);
void fri_count_latency(struct fri_loop *l, word now);

void fri_commands_start(struct commands *c);
void fri_take_command(struct fri_loop *l);
const double *fri_position_target(struct fri_loop *l, const double *ipo, double *buffer);
const double *fri_pose_target(struct fri_loop *l, const double *ipo, double *buffer);
void fri_efforts(struct fri_loop *l, double *tau, double *wrench);

void fri_exchange_update(struct fri_loop *l);
void fri_exchange_take(struct fri_loop *l);
void fri_exchange_write(struct fri_loop *l);
int fri_exchange_put(struct fri_loop *l, uint8_t *into);

int fri_law(struct fri_loop *l, const word *slot);

int fri_turn(struct fri_loop *l, const uint8_t *data, int size, word received);
int fri_answer(struct fri_loop *l);
void fri_finish(struct fri_loop *l, word now);
void fri_end(struct fri_loop *l);
int fri_may_end(const struct fri_loop *l);
void fri_forget_controller(struct fri_loop *l);

#endif
