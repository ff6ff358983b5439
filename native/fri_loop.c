/* Frequent cycles of the FRI loop in C. The Python modules are the reference: heptarm.fri.loop.cycle, fri.session and
   fri.guard. This file does the same, to the last bit, for messages that differ from the previous one in numbers only; every
   other message is handed back to Python unchanged.

   fri_layout.h is generated from the tables of the Python modules: layout of the shared memory, constants, and
   `struct loop`, whose members all have eight bytes. */
#include <arpa/inet.h>
#include <errno.h>
#include <math.h>
#include <poll.h>
#include <setjmp.h>
#include <signal.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <heptarm_law.h>
#include "kinematics.h"
#include "limited_steps.h"
#include "fri_layout.h"
#include "torque_guard.h"

enum { STATE_ARRAYS = (S_WRENCH - S_ARRAYS) / AXES };
/* Place of an array of a state in t_arrays, and its bit in t_known. */
#define ARRAY(word) (l->t_arrays + ((word) - S_ARRAYS))
#define KNOWN(word) ((int64_t)1 << ((word) - S_ARRAYS) / AXES)

word hf_size(void) { return sizeof(struct loop); }

/* ---------------------------------------------------------------------------------------------------- reading */

struct part {
    const uint8_t *at, *end;
};

static int varint(struct part *p, uint64_t *value) {
    *value = 0;
    for (int shift = 0; shift < 64 && p->at < p->end; shift += 7) {
        uint8_t byte = *p->at++;
        *value |= (uint64_t)(byte & 0x7f) << shift;
        if (byte < 0x80) return shift < 63 || byte < 2;
    }
    return 0;
}

/* Read the next field: its key, and its number or its bytes. */
static int field(struct part *p, uint64_t *key, uint64_t *number, struct part *bytes) {
    if (!varint(p, key) || *key >> 3 == 0) return 0;
    uint64_t size;
    switch (*key & 7) {
    case 0: return varint(p, number);
    case 1: size = 8; break;
    case 2:
        if (!varint(p, &size)) return 0;
        break;
    default: return 0;
    }
    if (size > (uint64_t)(p->end - p->at)) return 0;
    bytes->at = p->at;
    p->at += size;
    bytes->end = p->at;
    return 1;
}

/* Read seconds and nanoseconds; 0 if there is anything else. */
static int stamp(struct part p, word *nanos) {
    uint64_t key, seconds, rest;
    struct part none;
    if (!field(&p, &key, &seconds, &none) || key != 8 || seconds >> 32) return 0;
    if (!field(&p, &key, &rest, &none) || key != 16 || rest >> 32 || p.at < p.end) return 0;
    *nanos = (word)(seconds * 1000000000u + rest);
    return 1;
}

/* Read strategy and value of a redundancy; 0 if there is anything else. */
static int redundancy(struct part p, word *strategy, double *value) {
    uint64_t key, number;
    struct part bytes;
    if (!field(&p, &key, &number, &bytes) || key != 8 || (number != 0 && number != 4)) return 0;
    *strategy = (word)number;
    if (!field(&p, &key, &number, &bytes) || key != 17 || p.at < p.end) return 0;
    memcpy(value, bytes.at, 8);
    return 1;
}

static int is_plain_name(struct part p) {
    if (p.end - p.at > MAX_NAME) return 0;
    while (p.at < p.end)
        if (*p.at++ > 0x7f) return 0;
    return 1;
}

/* Read `count` doubles of field `tag`, packed or not, and for frames a name and a stamp; 0 if there is anything else. */
static int doubles(struct part p, int tag, int count, int frame, double *into) {
    int found = 0, names = 0;
    word none;
    while (p.at < p.end) {
        uint64_t key, number;
        struct part one;
        if (*p.at == (tag << 3 | 1) && found < count && p.end - p.at > 8) { /* a controller sends one by one */
            memcpy(into + found++, p.at + 1, 8);
            p.at += 9;
            continue;
        }
        if (!field(&p, &key, &number, &one)) return 0;
        if (frame && key == (1 << 3 | 2) && !names++ && is_plain_name(one)) continue;
        if (frame && key == (3 << 3 | 2) && stamp(one, &none)) continue;
        if (key >> 3 != (uint64_t)tag || (key & 7) == 0) return 0;
        int size = (one.end - one.at) / 8;
        if ((one.end - one.at) % 8 || found + size > count) return 0;
        memcpy(into + found, one.at, 8 * size);
        found += size;
    }
    return found == count && names == frame;
}

static int same(struct part p, const char *known, word size) {
    return p.end - p.at == size && !memcmp(p.at, known, size);
}

/* Whether a part begins with some bytes; moves behind them. */
static int starts_with(struct part *p, const uint8_t *known, word size) {
    if (p->end - p->at < size || memcmp(p->at, known, size)) return 0;
    p->at += size;
    return 1;
}

static uint32_t crc_table[256];

__attribute__((constructor)) static void make_table(void) {
    for (uint32_t i = 0; i < 256; i++) {
        uint32_t c = i;
        for (int k = 0; k < 8; k++) c = c & 1 ? 0xedb88320u ^ (c >> 1) : c >> 1;
        crc_table[i] = c;
    }
}

static uint32_t crc(const uint8_t *data, int size) {
    uint32_t c = 0xffffffffu;
    while (size--) c = crc_table[(c ^ *data++) & 0xff] ^ (c >> 8);
    return ~c;
}

/* Places of the joint arrays of MonitoringData, by field number. */
static const int monitored[16] = MONITORED;

struct seen {
    uint64_t sequence, reflected;
    word signals, requests;
};

/* Read the value of the signal that comes next; 0 if anything else than its value differs from the previous message. */
static int read_signal(struct loop *l, struct part p, word place) {
    if (place >= l->io_count || !starts_with(&p, l->io_head + HEAD * place, l->io_size[place]) || p.at >= p.end) return 0;
    uint64_t number;
    if (l->io_is_analog[place]) {
        if (p.end - p.at != 9 || *p.at != (5 << 3 | 1)) return 0;
        memcpy(l->t_io + place, p.at + 1, 8);
        return 1;
    }
    if (*p.at++ != 4 << 3 || !varint(&p, &number) || p.at < p.end) return 0;
    l->t_io[place] = (word)number;
    return 1;
}

/* Check a requested frame: its name; its stamp and its numbers may change. */
static int check_request(struct loop *l, struct part p, word place) {
    if (place >= l->request_count) return 0;
    int names = 0, found = 0, most = l->echoes ? 12 : 7;
    word none;
    while (p.at < p.end) {
        uint64_t key, number;
        struct part one;
        if (!field(&p, &key, &number, &one) || (key & 7) == 0) return 0;
        if (key == (1 << 3 | 2)) {
            if (names++ || !same(one, (char *)l->request_name + HEAD * place, l->request_size[place])) return 0;
        } else if (key >> 3 == 2) {
            if ((one.end - one.at) % 8) return 0;
            found += (int)(one.end - one.at) / 8;
        } else if (key != (3 << 3 | 2) || !stamp(one, &none)) {
            return 0;
        }
    }
    return names && found <= most;
}

/* Whether an array that may be sent back has positions that the robot can have, if the message has the array. */
static int is_plausible(struct loop *l, int array) {
    if (!(l->t_known & KNOWN(array))) return 1;
    for (int i = 0; i < AXES; i++)
        if (!(l->plausible_low[i] <= ARRAY(array)[i] && ARRAY(array)[i] <= l->plausible_high[i])) return 0;
    return 1;
}

/* Read a message into the t_ members; 0 if it differs from the previous one in more than numbers. */
static int read_message(struct loop *l, const uint8_t *data, int size, struct seen *seen) {
    struct part p = {data, data + size}, one;
    uint64_t key, number, id = 0;
    int tags = 0;
    if (l->framed) {
        uint32_t length, sum;
        if (size < 8) return 0;
        memcpy(&length, data, 4);
        memcpy(&sum, data + size - 4, 4);
        if (length != (uint32_t)size - 8 || crc(data + 4, size - 8) != sum) return 0;
        p.at += 4;
        p.end -= 4;
    }
    if (p.at >= p.end || *p.at != 0x0a) return 0;
    l->t_known = 0;
    l->t_tracking = l->t_e1 = l->t_wrench[0] = l->t_pose[0] = NAN;
    l->t_stamp = l->t_strategy = -1;
    seen->signals = seen->requests = 0;
    while (p.at < p.end) {
        if (!field(&p, &key, &number, &one) || (key & 7) != 2 || key > (6 << 3 | 2)) return 0;
        int tag = key >> 3;
        if (tag == 6) {
            if (!check_request(l, one, seen->requests++)) return 0;
            continue;
        }
        if (tags & 1 << tag) return 0;
        tags |= 1 << tag;
        if (tag == 2 && !same(one, l->robot, l->robot_size)) return 0;
        if (tag == 4 && !same(one, l->connection, l->connection_size)) return 0;
        if (tag == 2 || tag == 4) continue;
        int inner = 0;
        while (one.at < one.end) {
            struct part leaf;
            if (!field(&one, &key, &number, &leaf) || key >> 3 > 15) return 0;
            if (tag == 3 && key == (8 << 3 | 2)) {
                if (!read_signal(l, leaf, seen->signals++)) return 0;
                continue;
            }
            if (inner & 1 << (key >> 3)) return 0;
            inner |= 1 << (key >> 3);
            if (tag == 1) {
                if (key == 8) id = number;
                else if (key == 16) seen->sequence = number;
                else if (key == 24) seen->reflected = number;
                else return 0;
            } else if (tag == 3) {
                int at = (int)(key >> 3);
                if ((key & 7) != 2) return 0;
                if (monitored[at]) {
                    if (!doubles(leaf, 1, AXES, 0, ARRAY(monitored[at]))) return 0;
                    l->t_known |= KNOWN(monitored[at]);
                } else if (at == 6) {
                    if (!doubles(leaf, 1, 6, 0, l->t_wrench)) return 0;
                } else if (at == 9) {
                    if (!doubles(leaf, 2, AXES, 1, l->t_pose)) return 0;
                } else if (at == 10) {
                    if (!redundancy(leaf, &l->t_strategy, &l->t_e1)) return 0;
                } else if (at == 15) {
                    if (!stamp(leaf, &l->t_stamp)) return 0;
                } else {
                    return 0;
                }
            } else {
                if (key == 10) {
                    if (!doubles(leaf, 1, AXES, 0, ARRAY(S_Q_IPO))) return 0;
                    l->t_known |= KNOWN(S_Q_IPO);
                } else if (key == 10 << 3) {
                    if ((word)number != l->mode) return 0;
                } else if (key == 11 << 3) {
                    if ((word)number != l->overlay) return 0;
                } else if (key == (12 << 3 | 1)) {
                    memcpy(&l->t_tracking, leaf.at, 8);
                } else if (key == 18) { /* pose and redundancy of the interpolator are not used, but checked */
                    double unused[AXES];
                    if (!doubles(leaf, 2, AXES, 1, unused)) return 0;
                } else if (key == 26) {
                    double unused;
                    word none;
                    if (!redundancy(leaf, &none, &unused)) return 0;
                } else {
                    return 0;
                }
            }
        }
        if (tag == 1 && inner != 14) return 0;
        if (tag == 5 && ((l->mode && !(inner & 1 << 10)) || (l->overlay >= 0 && !(inner & 1 << 11)))) return 0;
    }
    if (seen->signals != l->io_count || seen->requests != l->request_count) return 0;
    if (id != MONITORING_ID || seen->sequence >> 32 || seen->reflected >> 32) return 0;
    if (!(tags & 1 << 4) || (!(tags & 1 << 2)) != (l->robot_size < 0)) return 0;
    if (!(tags & 1 << 5) && (l->mode || l->overlay >= 0)) return 0;
    if (l->t_known & KNOWN(S_Q)) {
        double sum = 0.0;
        for (int i = 0; i < AXES; i++) sum += ARRAY(S_Q)[i];
        if (!isfinite(sum)) return 0;
    }
    return is_plausible(l, S_Q_CMD) && is_plausible(l, S_Q_IPO);
}

/* ------------------------------------------------------------------------------------------------------ guard */

static void limited(struct loop *l, int kind, int axis, double asked, double allowed) {
    int at = AXES * kind + axis;
    double *worst = (double *)l->header + H_LIMITED_WORST + at;
    l->header[H_LIMITED_COUNTS + at]++;
    l->t_flags |= LIMITED;
    if (fabs(asked) >= *worst) {
        *worst = fabs(asked);
        ((double *)l->header)[H_LIMITED_ALLOWED + at] = fabs(allowed);
    }
}

static void report_violation(struct loop *l, int i, double step, double wanted, double a) {
    double t = l->step;
    if (fabs(step) > l->top_v[i])
        limited(l, LIMITED_VELOCITY, i, step / t, l->dq_max[i]);
    else if (fabs(wanted) > l->top_a[i])
        limited(l, LIMITED_ACCELERATION, i, wanted / (t * t), l->ddq_max[i]);
    else
        limited(l, LIMITED_JERK, i, (wanted - a) / (t * t * t), l->dddq_max[i]);
}

static double bounded(struct loop *l, int i, double goal, double before, const double *ipo) {
    if (!isfinite(goal)) {
        limited(l, LIMITED_NOT_FINITE, i, 0.0, 0.0);
        return before;
    }
    double low = l->low[i], high = l->high[i], kept;
    if (ipo) {
        double lower = most(low, least(ipo[i] - l->reach, high));
        high = least(high, most(ipo[i] + l->reach, lower));
        low = lower;
    }
    kept = least(most(goal, low), high);
    if (kept != goal) limited(l, LIMITED_POSITION, i, goal, kept);
    return kept;
}

static double approach(struct loop *l, int i, double goal, double before) {
    double q = l->q[i], v = l->v[i], a = l->a[i], high = l->top_v[i], top = l->top_a[i], jerk = l->top_j[i];
    double step = goal - q, wanted = step - v;
    int is_there;
    double acc = acceleration_to(step, least(most(goal - before, -high), high), v, a, high, top, jerk, &is_there);
    if (!is_there) report_violation(l, i, step, wanted, a);
    double speed = v + acc, there = q + speed;
    if (there + overrun(speed, acc, top, jerk) > l->high[i] || there - overrun(-speed, -acc, top, jerk) < l->low[i]) {
        double braking = brake(v, a, top, jerk);
        if (braking != acc && wanted == acc) report_violation(l, i, step, wanted, a);
        return braking;
    }
    return acc;
}

static void position(struct loop *l, const double *target, const double *ipo) {
    for (int i = 0; i < AXES; i++) {
        double now = l->q[i], speed = l->v[i], acc;
        if (!target) {
            acc = brake(speed, l->a[i], l->top_a[i], l->top_j[i]);
            l->v[i] = speed + acc;
            l->a[i] = acc;
            l->q[i] = l->r[i] = now + l->v[i];
            continue;
        }
        double goal = target[i], before = l->r[i];
        if (!(l->low[i] <= goal && goal <= l->high[i]) || ipo) goal = bounded(l, i, goal, before, ipo);
        l->r[i] = goal;
        double step = goal - now, jerk = l->top_j[i];
        acc = step - speed;
        if (fabs(ON_TRACK * (step - goal + before)) <= jerk && fabs(acc - l->a[i]) <= jerk &&
            fabs(step) + acc * acc / (2.0 * jerk) <= l->top_v[i] && fabs(acc) <= l->top_a[i] &&
            l->low[i] + l->near[i] <= goal && goal <= l->high[i] - l->near[i]) {
            l->q[i] = goal;
            l->v[i] = step;
            l->a[i] = acc;
            continue;
        }
        acc = approach(l, i, goal, before);
        l->v[i] = speed + acc;
        l->a[i] = acc;
        l->q[i] = acc == step - speed ? goal : now + l->v[i];
    }
}

static void slew(struct loop *l, double *last, const double *target, const double *limit, const double *step, int size, int kind) {
    for (int i = 0; i < size; i++) {
        double kept = last[i];
        if (isfinite(target[i])) {
            kept = least(most(target[i], -limit[i]), limit[i]);
            if (kept != target[i]) limited(l, kind, i, target[i], limit[i]);
        } else {
            limited(l, LIMITED_NOT_FINITE, i, 0.0, 0.0);
        }
        last[i] = least(most(kept, last[i] - step[i]), last[i] + step[i]);
    }
}

void hf_start_torque_guard(struct torque_guard *guard) { start_torque_guard(guard); }

int hf_guard_torques(struct torque_guard *guard, const double *q, const double *dq, double dt, int is_braking, double *tau) {
    return guard_torques(guard, q, dq, dt, is_braking, tau);
}

/* ----------------------------------------------------------------------------------------------------- fallback */

static void take_command(struct loop *l) {
    word count = __atomic_load_n(&l->header[H_COMMANDS], __ATOMIC_ACQUIRE);
    if (count == l->commands_seen || count == 0) return;
    word copy[COMMAND_WORDS], *slot = l->commands + (count - 1) % COMMAND_SLOTS * COMMAND_WORDS;
    if (__atomic_load_n(slot, __ATOMIC_ACQUIRE) != 2 * (count - 1) + 2) return;
    memcpy(copy, slot, sizeof copy);
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    if (__atomic_load_n(slot, __ATOMIC_RELAXED) != 2 * (count - 1) + 2) return;
    l->commands_seen = count;
    word when = copy[C_AT], given = copy[C_GIVEN];
    double *numbers = (double *)copy;
    if (when + GRACE < l->started) return;
    if (given & GIVEN_Q) {
        double gap = (double)(when - l->f_at) * 1e-9;
        l->f_has_slope = l->f_has_q && 0.0 < gap && gap <= l->patience;
        for (int i = 0; i < AXES; i++) {
            if (l->f_has_slope) l->f_slope[i] = (numbers[C_Q + i] - l->f_q[i]) / gap;
            l->f_q[i] = numbers[C_Q + i];
        }
        l->f_has_q = 1;
    }
    if (given & GIVEN_TAU) memcpy(l->f_tau, numbers + C_TAU, sizeof l->f_tau), l->f_has_tau = 1;
    if (given & GIVEN_WRENCH) memcpy(l->f_wrench, numbers + C_WRENCH, sizeof l->f_wrench), l->f_has_wrench = 1;
    l->f_at = when;
}

static const double *position_target(struct loop *l, const double *ipo, double *buffer) {
    if (!l->f_at) return ipo;
    double age = (double)(l->t_received - l->f_at) * 1e-9, late = age - l->patience;
    if (late > 0.0) l->t_flags |= FILLED;
    if (l->f_missing != HOLD && late > (l->f_missing == EXTRAPOLATE ? l->over : 0.0)) return NULL;
    if (!l->f_has_q) return ipo;
    if (l->f_missing != EXTRAPOLATE || !l->f_has_slope) return l->f_q;
    for (int i = 0; i < AXES; i++) buffer[i] = l->f_q[i] + l->f_slope[i] * age;
    return buffer;
}

static double fraction_left(struct loop *l) {
    if (!l->f_at || l->f_missing == HOLD) return 1.0;
    double late = (double)(l->t_received - l->f_at) * 1e-9 - l->patience;
    if (l->f_missing == EXTRAPOLATE) late -= l->over;
    if (late <= 0.0) return 1.0;
    return l->over > 0.0 ? most(0.0, 1.0 - late / l->over) : 0.0;
}

/* ----------------------------------------------------------------------------------------------------- writing */

static uint8_t *put_varint(uint8_t *at, uint64_t value) {
    for (; value > 0x7f; value >>= 7) *at++ = (uint8_t)(value | 0x80);
    *at++ = (uint8_t)value;
    return at;
}

static uint8_t *put_joints(uint8_t *at, uint8_t key, const double *values) {
    *at++ = key;
    *at++ = 63;
    for (int i = 0; i < AXES; i++, at += 9) {
        *at = 9;
        memcpy(at + 1, values + i, 8);
    }
    return at;
}

/* Whether the cabinet shows an output as it was written; its first answer is sent in any case. */
static int is_shown(struct loop *l, int index) {
    word place = l->pending_signal[index], shown = l->t_io[place], value = l->pending_value[index];
    double analog, wanted;
    if (l->pending_left[index] >= REPEATS) return 0;
    if (!l->io_is_analog[place]) return shown == value;
    memcpy(&analog, &shown, 8);
    memcpy(&wanted, &value, 8);
    return analog == wanted;
}

/* Whether Python has to report an output that the cabinet does not accept. */
static int is_refused(struct loop *l) {
    for (int i = 0; i < l->pending_count; i++)
        if (!l->pending_left[i] && !is_shown(l, i) && !l->io_is_analog[l->pending_signal[i]]) return 1;
    return 0;
}

/* Write the frames, and the outputs that the cabinet does not show yet. */
static uint8_t *put_exchange(struct loop *l, uint8_t *at) {
    int kept = 0;
    memcpy(at, l->frames, (size_t)l->frames_size);
    at += l->frames_size;
    for (int i = 0; i < l->pending_count; i++) {
        if (is_shown(l, i) || !l->pending_left[i]) continue;
        word place = l->pending_signal[i], value = l->pending_value[i], size = l->put_size[place];
        uint8_t number[10], *end = number + 8;
        if (l->io_is_analog[place])
            memcpy(number, &value, 8);
        else
            end = put_varint(number, (uint64_t)value);
        *at++ = 5 << 3 | 2;
        *at++ = (uint8_t)(size + 1 + (end - number));
        memcpy(at, l->put_head + HEAD * place, (size_t)size);
        at += size;
        *at++ = l->io_is_analog[place] ? 5 << 3 | 1 : 4 << 3;
        memcpy(at, number, (size_t)(end - number));
        at += end - number;
        l->pending_signal[kept] = place;
        l->pending_value[kept] = value;
        l->pending_left[kept++] = l->pending_left[i] - 1;
    }
    l->pending_count = kept;
    return at;
}

static int write_command(struct loop *l, const double *q, const double *tau, const double *wrench) {
    uint8_t *begin = l->t_reply + (l->framed ? 4 : 0), *at = begin + 2;
    at = put_varint((*at = 8, at + 1), COMMAND_ID);
    at = put_varint((*at = 16, at + 1), (uint64_t)l->sent);
    at = put_varint((*at = 24, at + 1), (uint64_t)l->sequence);
    begin[0] = 10;
    begin[1] = (uint8_t)(at - begin - 2);
    uint8_t exchange[BUFFER];
    word size = put_exchange(l, exchange) - exchange;
    if (q || size) {
        *at++ = 18;
        at = put_varint(at, (uint64_t)((q ? 65 : 0) + (q && wrench ? 52 : 0) + (q && tau ? 65 : 0) + size));
    }
    if (q) {
        at = put_joints(at, 10, q);
        if (wrench) {
            memcpy(at, "\x12\x32\x0a\x30", 4);
            memcpy(at + 4, wrench, 48);
            at += 52;
        }
        if (tau) at = put_joints(at, 26, tau);
    }
    memcpy(at, exchange, (size_t)size);
    at += size;
    if (l->framed) {
        uint32_t length = (uint32_t)(at - begin), sum = crc(begin, (int)length);
        memcpy(l->t_reply, &length, 4);
        memcpy(at, &sum, 4);
        at += 4;
    }
    l->sent = (l->sent + 1) & 0xffffffff;
    l->waiting = 0;
    l->header[H_COUNTS + COUNT_ANSWERED]++;
    l->t_answer = 1;
    return (int)(at - l->t_reply);
}

static const double zeros[AXES];

/* Limit target torques by size and rate, then by the motion to which they lead. */
static void torque(struct loop *l, const double *target, int is_braking) {
    static const struct { int bit, kind; } parts[] = {
        {GUARD_SPEED_BIT, LIMITED_VELOCITY}, {GUARD_POSITION_BIT, LIMITED_POSITION}, {GUARD_TORQUE_BIT, LIMITED_TORQUE}};
    struct torque_guard *guard = (struct torque_guard *)l->torque_guard;
    slew(l, l->tau, target, l->tau_max, l->tau_step, AXES, LIMITED_TORQUE);
    memcpy(l->tau_sent, l->tau, sizeof l->tau_sent);
    if (!guard) return;
    int found = guard_torques(guard, ARRAY(S_Q), l->dq, l->step, is_braking, l->tau_sent);
    for (int part = 0; part < 3 && found; part++)
        for (int i = 0; i < AXES; i++)
            if (found >> (parts[part].bit + i) & 1) limited(l, parts[part].kind, i, guard->asked[i], guard->allowed[i]);
}

static int command(struct loop *l, const double *target, const double *tau, const double *wrench) {
    const double *ipo = ARRAY(S_Q_IPO);
    if (!target) l->t_flags |= BRAKING;
    position(l, target, isinf(l->reach) ? NULL : ipo);
    if (l->mode == TORQUE) torque(l, tau, !target);
    if (l->mode == WRENCH) slew(l, l->wrench, wrench, l->wrench_max, l->wrench_step, 6, LIMITED_WRENCH);
    l->header[H_COUNTS + COUNT_LIMITED] += (l->t_flags & LIMITED) != 0;
    l->header[H_COUNTS + COUNT_FILLED] += (l->t_flags & FILLED) != 0;
    l->header[H_COUNTS + COUNT_COMMANDED]++;
    return write_command(l, l->q, l->mode == TORQUE ? l->tau_sent : NULL, l->mode == WRENCH ? l->wrench : NULL);
}

/* ----------------------------------------------------------------------------------------------------- a turn */

static void count_duration(struct loop *l, word *histogram, word nanos) {
    word micros = nanos > 0 ? nanos / 1000 : 0;
    histogram[micros < l->bins ? micros : l->bins - 1]++;
    if (nanos > histogram[l->bins]) histogram[l->bins] = nanos < LONGEST ? nanos : LONGEST;
}

static void fill_state(struct loop *l, word *slot) {
    double *numbers = (double *)slot;
    int active = l->state == COMMANDING_ACTIVE;
    slot[S_RECEIVED] = l->t_received;
    slot[S_SEQUENCE] = l->sequence;
    slot[S_STAMP] = l->t_stamp < 0 ? 0 : l->t_stamp;
    slot[S_SESSION] = l->state;
    slot[S_QUALITY] = l->quality;
    slot[S_MODE] = l->mode;
    slot[S_OVERLAY] = l->overlay;
    slot[S_SAFETY] = l->safety;
    slot[S_OPERATION] = l->operation;
    slot[S_CONTROL] = l->control;
    slot[S_DRIVE] = l->drive;
    slot[S_PERIOD] = l->period;
    slot[S_MULTIPLIER] = l->receive_multiplier;
    slot[S_LATENCY] = 0;
    slot[S_FLAGS] = l->t_flags;
    slot[S_REFLECTED] = l->reflected;
    slot[S_SENT] = l->sent;
    slot[S_TICKS] = active && l->ticks > 0 ? l->ticks : 0;
    slot[S_STRATEGY] = l->t_strategy;
    numbers[S_TRACKING] = l->t_tracking;
    for (int array = 0; array < STATE_ARRAYS; array++)
        for (int i = 0; i < AXES; i++) numbers[S_ARRAYS + AXES * array + i] = l->t_known >> array & 1 ? l->t_arrays[AXES * array + i] : NAN;
    for (int i = 0; i < 6; i++) numbers[S_WRENCH + i] = isnan(l->t_wrench[0]) ? NAN : l->t_wrench[i];
    for (int i = 0; i < AXES; i++) numbers[S_POSE + i] = isnan(l->t_pose[0]) ? NAN : l->t_pose[i];
    numbers[S_E1] = l->t_e1;
    for (int i = 0; i < AXES; i++) {
        numbers[S_Q_SENT + i] = active && l->t_answer ? l->q[i] : NAN;
        numbers[S_TAU_SENT + i] = active && l->t_answer && l->mode == TORQUE ? l->tau_sent[i] : NAN;
        if (i < 6) numbers[S_WRENCH_SENT + i] = active && l->t_answer && l->mode == WRENCH ? l->wrench[i] : NAN;
    }
    for (int i = S_POSE_IPO; i < S_IO; i++) numbers[i] = NAN; /* Python handles sessions that command poses */
    for (int i = 0; i < MAX_IO; i++) {
        numbers[S_IO + i] = i < l->io_count ? (double)(uint64_t)l->t_io[i] : NAN;
        if (i < l->io_count && l->io_is_analog[i]) memcpy(numbers + S_IO + i, l->t_io + i, 8);
    }
}

static word clock_now(clockid_t clock) {
    struct timespec t;
    clock_gettime(clock, &t);
    return t.tv_sec * 1000000000LL + t.tv_nsec;
}

/* ------------------------------------------------------------------------------------------------ compiled laws */

typedef int (*compiled_law)(const struct heptarm_state *, struct heptarm_command *, const void *, void *);

/* A law that crashes or does not return is left by a jump; the arm then brakes. Only one thread of a process runs a law. */
static sigjmp_buf law_exit;
static volatile sig_atomic_t in_law;
static timer_t law_timer;
static int has_timer;
static word law_armed; /* when the timer was set */
static char law_stack[1 << 16]; /* for the handler of a stack overflow */
static const int crashes[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
#define TIME_IS_UP (SIGRTMIN + 5)

static void on_signal(int number) {
    if (in_law) {
        in_law = 0;
        siglongjmp(law_exit, number);
    }
    if (number == TIME_IS_UP) return; /* the law had just returned */
    signal(number, SIG_DFL);
    raise(number);
}

/* Prepare this thread for running a compiled law; 0 if the system refuses the timer. */
int hf_protect(void) {
    struct sigaction action = {.sa_handler = on_signal, .sa_flags = SA_NODEFER | SA_ONSTACK};
    stack_t stack = {.ss_sp = law_stack, .ss_size = sizeof law_stack};
    struct sigevent event = {.sigev_notify = SIGEV_THREAD_ID, .sigev_signo = TIME_IS_UP};
    sigemptyset(&action.sa_mask);
    sigaltstack(&stack, NULL);
    for (unsigned i = 0; i < sizeof crashes / sizeof *crashes; i++) sigaction(crashes[i], &action, NULL);
    sigaction(TIME_IS_UP, &action, NULL);
#ifndef sigev_notify_thread_id
#define sigev_notify_thread_id _sigev_un._tid
#endif
    event.sigev_notify_thread_id = (pid_t)syscall(SYS_gettid);
    has_timer = !timer_create(CLOCK_THREAD_CPUTIME_ID, &event, &law_timer);
    return has_timer;
}

/* Copy the newest slot of a ring behind its sequence word; 0 if there is none after `seen`, or it is being written. */
static int take_slot(const word *ring, word count, word slots, word size, word *seen, double *into) {
    if (count == *seen || count == 0) return 0;
    const word *slot = ring + (count - 1) % slots * (size + 1);
    if (__atomic_load_n(slot, __ATOMIC_ACQUIRE) != 2 * count) return 0;
    memcpy(into, slot + 1, 8 * (size_t)size);
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    if (__atomic_load_n(slot, __ATOMIC_RELAXED) != 2 * count) return 0;
    *seen = count;
    return 1;
}

/* Let parameters follow their targets for a cycle of `dt` seconds, each by its largest change in a second; one that is or becomes
   NaN or infinite changes at once. */
void hf_follow(double *values, const double *targets, const double *rates, word count, double dt) {
    for (word i = 0; i < count; i++) {
        double step = rates[i] * dt, apart = targets[i] - values[i];
        values[i] = isfinite(apart) && fabs(apart) > step ? values[i] + copysign(step, apart) : targets[i];
    }
}

static void take_parameters(struct loop *l, double dt) {
    double *copy = (double *)l->law_buffer;
    word size = l->params_size, many = l->memory_size, before = l->params_seen;
    word count = __atomic_load_n(&l->header[H_PARAMS], __ATOMIC_ACQUIRE);
    if (take_slot(l->params_ring, count, PARAM_SLOTS, size, &l->params_seen, copy)) {
        memcpy(l->params_target, copy, 8 * (size_t)size);
        if (!before) memcpy(l->params, copy, 8 * (size_t)size);
    }
    hf_follow((double *)l->params, (double *)l->params_target, (double *)l->params_rates, size, dt);
    count = __atomic_load_n(&l->header[H_MEMORY_SET], __ATOMIC_ACQUIRE);
    if (!take_slot(l->memory_set_ring, count, MEMORY_SLOTS, 2 * many, &l->memory_seen, copy)) return;
    for (word i = 0; i < many; i++) {
        double *written = (double *)l->memory_written + i;
        if (copy[many + i] <= *written) continue;
        *written = copy[many + i];
        ((double *)l->memory)[i] = copy[i];
    }
}

static void publish_memory(struct loop *l) {
    word tick = l->header[H_MEMORY], *slot = l->memory_ring + tick % MEMORY_SLOTS * (l->memory_size + 1);
    __atomic_store_n(slot, 2 * tick + 1, __ATOMIC_RELAXED);
    __atomic_thread_fence(__ATOMIC_RELEASE);
    memcpy(slot + 1, l->memory, 8 * (size_t)l->memory_size);
    __atomic_store_n(slot, 2 * tick + 2, __ATOMIC_RELEASE);
    __atomic_store_n(&l->header[H_MEMORY], tick + 1, __ATOMIC_RELEASE);
}

static void law_state(struct loop *l, const word *slot, struct heptarm_state *s) {
    const double *numbers = (const double *)slot;
    word multiplier = slot[S_MULTIPLIER] > 0 ? slot[S_MULTIPLIER] : 1;
    s->dt = (double)(slot[S_PERIOD] * multiplier) * 1e-9;
    s->t = (double)slot[S_TICKS] * ((double)slot[S_PERIOD] * 1e-9);
    s->tracking = numbers[S_TRACKING];
    memcpy(s->q, numbers + S_Q, sizeof s->q);
    memcpy(s->dq, l->dq, sizeof s->dq);
    memcpy(s->tau, numbers + S_TAU, sizeof s->tau);
    memcpy(s->tau_cmd, numbers + S_TAU_CMD, sizeof s->tau_cmd);
    memcpy(s->tau_ext, numbers + S_TAU_EXT, sizeof s->tau_ext);
    memcpy(s->q_cmd, numbers + S_Q_CMD, sizeof s->q_cmd);
    memcpy(s->q_ipo, numbers + S_Q_IPO, sizeof s->q_ipo);
    memcpy(s->wrench, numbers + S_WRENCH, sizeof s->wrench);
    s->sequence = slot[S_SEQUENCE];
    s->stamp = slot[S_STAMP];
    s->received = slot[S_RECEIVED];
    s->session = slot[S_SESSION];
    s->quality = slot[S_QUALITY];
    s->mode = slot[S_MODE];
    s->safety = slot[S_SAFETY];
    s->operation_mode = slot[S_OPERATION];
    s->control_mode = slot[S_CONTROL];
}

static int all_finite(const double *values, int size) {
    double sum = 0.0;
    for (int i = 0; i < size; i++) sum += values[i] - values[i];
    return sum == 0.0;
}

/* Whether the law has given numbers for everything that this session commands; the pose's guard is in Python. */
static int is_finite(struct loop *l) {
    return all_finite(l->out_q, AXES) && (l->mode != TORQUE || all_finite(l->out_tau, AXES)) &&
           (l->mode != WRENCH || all_finite(l->out_wrench, 6));
}

static int failed(struct loop *l, int status, word code) {
    l->law_code = code;
    return (int)(l->law_status = status);
}

/* Call the compiled law on the state in a slot, with its prepared output in the out_ members: LAW_OK, or why it failed. */
int hf_law(struct loop *l, const word *slot) {
    struct heptarm_state state;
    struct itimerspec limit = {.it_value = {.tv_sec = LAW_CUT / 1000000000LL, .tv_nsec = LAW_CUT % 1000000000LL}};
    law_state(l, slot, &state);
    take_parameters(l, state.dt);
    word budget = (word)(l->law_fraction * state.dt * 1e9), began = clock_now(CLOCK_MONOTONIC);
    int number = sigsetjmp(law_exit, 0);
    if (number) return failed(l, number == TIME_IS_UP ? LAW_ENDLESS : LAW_CRASHED, number);
    if (has_timer && began - law_armed > LAW_CUT / 4) { /* not in every call: it takes as long as a short law */
        timer_settime(law_timer, 0, &limit, NULL);
        law_armed = began;
    }
    in_law = 1;
    int code = ((compiled_law)l->law)(&state, (struct heptarm_command *)l->out_q, l->params, l->memory);
    in_law = 0;
    publish_memory(l);
    if (code != l->law_success) return failed(l, LAW_REFUSED, code);
    l->law_not_finite = is_finite(l) ? 0 : l->law_not_finite + 1;
    if (l->law_not_finite >= LAW_PATIENCE) return failed(l, LAW_NOT_FINITE, l->law_not_finite);
    word took = clock_now(CLOCK_MONOTONIC) - began;
    l->law_late = took > budget ? l->law_late + 1 : 0;
    l->header[H_OVERRUNS] += took > budget;
    return l->law_late >= LAW_PATIENCE ? failed(l, LAW_SLOW, took) : LAW_OK;
}

static word *open_slot(struct loop *l) {
    word tick = l->header[H_STATES], *slot = l->states + tick % l->history * STATE_WORDS;
    __atomic_store_n(slot, 2 * tick + 1, __ATOMIC_RELAXED);
    __atomic_thread_fence(__ATOMIC_RELEASE);
    return slot;
}

int hf_answer(struct loop *l);

/* Velocity by the difference to the previous message; the posture for the estimate of the wrench. */
static void differentiate(struct loop *l) {
    double gap = (double)l->period * 1e-9;
    int known = (l->t_known & KNOWN(S_Q)) != 0, is_near = l->q_known;
    for (int i = 0; i < AXES; i++) is_near = is_near && fabs(ARRAY(S_Q)[i] - l->q_before[i]) <= NEARBY;
    memcpy(l->posture, is_near ? l->q_before : ARRAY(S_Q), sizeof l->posture);
    for (int i = 0; i < AXES; i++) {
        double q = ARRAY(S_Q)[i];
        l->dq[i] = !known ? NAN : l->q_known && gap > 0.0 ? (q - l->q_before[i]) / gap : 0.0;
        l->q_before[i] = q;
    }
    l->q_known = known;
}

/* Whether an external torque is outside its band: Python then names the joint and lets the arm brake. */
static int is_collision(struct loop *l) {
    if (!(l->t_known & KNOWN(S_TAU_EXT))) return 1;
    double gap = (double)l->period * 1e-9;
    for (int i = 0; i < AXES; i++) {
        double speed = l->q_known && l->t_known & KNOWN(S_Q) && gap > 0.0 ? (ARRAY(S_Q)[i] - l->q_before[i]) / gap : 0.0;
        double allowed = l->watch_threshold[i] + l->watch_margin[i] * fabs(speed);
        if (!(fabs(ARRAY(S_TAU_EXT)[i] - l->watch_baseline[i]) - allowed <= 0.0)) return 1;
    }
    return 0;
}

/* Make the map of a posture, unless it is there. */
static void map_posture(struct loop *l, const double *q) {
    struct wrench_map *map = (struct wrench_map *)l->map;
    if (!l->has_map || memcmp(map->q, q, sizeof map->q)) l->has_map = map_wrenches((const struct chain *)l->chain, q, map);
}

/* Estimate the external wrench from the torques where the controller sends none. */
static void find_wrench(struct loop *l) {
    word needed = KNOWN(S_Q) | KNOWN(S_TAU_EXT);
    if (!isnan(l->t_wrench[0]) || !l->has_chain || (l->t_known & needed) != needed) return;
    map_posture(l, l->posture);
    if (!l->has_map) return;
    explain_torques((const struct wrench_map *)l->map, ARRAY(S_TAU_EXT), l->t_wrench);
    l->t_flags |= ESTIMATED;
}

/* Process a datagram: HANDBACK, LAW (call hf_answer next), or the size of the answer in t_reply, 0 for none. */
int hf_turn(struct loop *l, const uint8_t *data, int size, word received) {
    struct seen seen = {0};
    int commanding = l->state == COMMANDING_ACTIVE, waiting = l->state == COMMANDING_WAIT;
    if (!l->hot || !read_message(l, data, size, &seen)) return HANDBACK;
    if (seen.sequence != (((uint64_t)l->sequence + 1) & 0xffffffff)) return HANDBACK;
    if ((commanding || waiting) && !(l->t_known & KNOWN(S_Q_IPO))) return HANDBACK;
    if (*l->outputs != l->outputs_seen || is_refused(l)) return HANDBACK;
    if (commanding) {
        word gap = received - l->received;
        if (!l->is_started || (l->has_watch && !l->is_ending && is_collision(l))) return HANDBACK;
        if ((double)gap > most(GAP_PERIODS * (double)l->period * (double)l->multiplier, MIN_GAP)) return HANDBACK;
    }
    /* from here on the message is not handed back */
    word *counts = l->header + H_COUNTS;
    counts[COUNT_RECEIVED]++;
    counts[COUNT_POOR + l->quality]++;
    if (l->period) {
        word off = received - l->received - l->period;
        count_duration(l, l->jitter, off < 0 ? -off : off);
    }
    if ((word)seen.reflected > l->reflected && (word)seen.reflected <= l->sent) {
        counts[COUNT_MISSED] += (word)seen.reflected - l->reflected - 1;
        l->reflected = (word)seen.reflected;
    }
    l->sequence = (word)seen.sequence;
    l->received = l->t_received = received;
    l->t_flags = l->t_answer = 0;
    l->waiting++;
    differentiate(l);
    if (commanding && l->has_law) find_wrench(l); /* else after the answer */
    if (commanding) {
        l->ticks++;
    } else if (waiting) {
        double gap = l->ipo_known ? (double)((word)seen.sequence - l->ipo_sequence) * (double)l->period * 1e-9 : 0.0;
        for (int i = 0; i < AXES; i++) {
            l->slope[i] = gap > 0.0 ? (ARRAY(S_Q_IPO)[i] - l->ipo[i]) / gap : 0.0;
            l->ipo[i] = ARRAY(S_Q_IPO)[i];
        }
        l->ipo_known = 1;
        l->ipo_sequence = l->sequence;
    }
    if (l->waiting < l->multiplier) return 0;
    if (!commanding && !waiting) return write_command(l, l->echoes && l->t_known & KNOWN(S_Q_CMD) ? ARRAY(S_Q_CMD) : NULL, NULL, NULL);
    if (waiting)
        return write_command(l, ARRAY(S_Q_IPO), l->mode == TORQUE ? zeros : NULL, l->mode == WRENCH ? zeros : NULL);
    if (l->is_ending) return command(l, NULL, zeros, zeros);
    if (l->has_law) {
        memcpy(l->out_q, ARRAY(S_Q_IPO), sizeof l->out_q);
        memset(l->out_tau, 0, sizeof l->out_tau);
        memset(l->out_wrench, 0, sizeof l->out_wrench);
        for (int i = 0; i < AXES; i++) l->out_pose[i] = NAN; /* no pose is commanded here */
        l->out_e1 = NAN;
        word *slot = open_slot(l);
        fill_state(l, slot);
        if (!l->law) return LAW;
        l->is_ending = hf_law(l, slot) != LAW_OK;
        return hf_answer(l);
    }
    double buffer[AXES], tau[AXES], wrench[6], fraction;
    take_command(l);
    const double *target = position_target(l, ARRAY(S_Q_IPO), buffer);
    fraction = fraction_left(l);
    for (int i = 0; i < AXES; i++) {
        tau[i] = l->f_has_tau ? fraction * l->f_tau[i] : 0.0;
        if (i < 6) wrench[i] = l->f_has_wrench ? fraction * l->f_wrench[i] : 0.0;
    }
    return command(l, target, tau, wrench);
}

/* Make the answer after the law was called (the arm brakes if it failed). */
int hf_answer(struct loop *l) {
    if (l->is_ending) return command(l, NULL, zeros, zeros);
    return command(l, l->out_q, l->out_tau, l->out_wrench);
}

/* Publish the turn; its answer was sent at `now`. Then prepare the next one. */
void hf_finish(struct loop *l, word now) {
    word tick = l->header[H_STATES], *slot = open_slot(l);
    find_wrench(l);
    if (l->t_answer) {
        l->t_flags |= ANSWERED;
        count_duration(l, l->latency, now - l->received);
    }
    fill_state(l, slot);
    slot[S_LATENCY] = l->t_answer ? now - l->received : 0;
    __atomic_store_n(slot, 2 * tick + 2, __ATOMIC_RELEASE);
    __atomic_store_n(&l->header[H_STATES], tick + 1, __ATOMIC_RELEASE);
    l->header[H_BEAT] = now;
    if (l->t_flags & ESTIMATED) map_posture(l, ARRAY(S_Q));
}

static void reply(struct loop *l, int size) {
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons((uint16_t)l->port)};
    to.sin_addr.s_addr = (uint32_t)l->address;
    sendto((int)l->sock, l->t_reply, (size_t)size, 0, (struct sockaddr *)&to, sizeof to);
}

/* After the law was called: answer, send, publish. */
void hf_send(struct loop *l) {
    reply(l, hf_answer(l));
    hf_finish(l, clock_now(CLOCK_MONOTONIC));
}

/* Receive a datagram of at most BUFFER bytes, its sender and the time of receipt by the kernel; its size, or -1. */
static ssize_t receive(int sock, int flags, uint8_t *into, struct sockaddr_in *from, word *received) {
    char control[128];
    struct iovec part = {into, BUFFER};
    struct msghdr message = {.msg_name = from, .msg_namelen = sizeof *from, .msg_iov = &part, .msg_iovlen = 1,
                             .msg_control = control, .msg_controllen = sizeof control};
    ssize_t size = recvmsg(sock, &message, flags);
    if (size < 0) return size;
    *received = clock_now(CLOCK_MONOTONIC);
    for (struct cmsghdr *head = CMSG_FIRSTHDR(&message); head; head = CMSG_NXTHDR(&message, head)) {
        struct timespec stamp;
        if (head->cmsg_level != SOL_SOCKET || head->cmsg_type != SCM_TIMESTAMPNS) continue;
        memcpy(&stamp, CMSG_DATA(head), sizeof stamp);
        word age = clock_now(CLOCK_REALTIME) - stamp.tv_sec * 1000000000LL - stamp.tv_nsec;
        if (age >= 0 && age < 10000000000LL) *received -= age;
    }
    return size;
}

/* The floor of a reply on this machine: send `turns` datagrams back, with the time from receipt to reply of each [ns]; how
   many came. */
word hf_echo(int sock, word turns, word *took) {
    uint8_t datagram[BUFFER];
    for (word turn = 0; turn < turns; turn++) {
        struct sockaddr_in from;
        word received;
        ssize_t size = receive(sock, 0, datagram, &from, &received);
        if (size < 0) return turn;
        sendto(sock, datagram, (size_t)size, 0, (struct sockaddr *)&from, sizeof from);
        took[turn] = clock_now(CLOCK_MONOTONIC) - received;
    }
    return turns;
}

/* ---------------------------------------------------------------------------------------------------- warming up */

/* A copy of the loop that answers the last message once more, and what it writes instead of the shared memory. */
static struct {
    struct loop loop;
    word header[H_LIMITED_ALLOWED + (LIMITED_WRENCH + 1) * AXES], durations[2], state[STATE_WORDS], memory[MEMORY_SLOTS];
} spare;

static int no_law(const struct heptarm_state *s, struct heptarm_command *out, const void *p, void *m) {
    (void)s, (void)out, (void)p, (void)m;
    return (int)spare.loop.law_success;
}

/* Make the answer to the message in t_datagram once more, but for the user's law, and forget it; returns what the turn did.
   While the thread sleeps, other programs take the caches that it needs. */
int hf_warm_up(struct loop *l, int size) {
    struct loop *copy = &spare.loop;
    memcpy(copy, l, offsetof(struct loop, t_datagram));
    memcpy(spare.header, l->header, sizeof spare.header);
    copy->header = spare.header;
    copy->latency = copy->jitter = spare.durations;
    copy->states = spare.state;
    copy->history = copy->bins = 1;
    copy->sequence--;
    if (copy->law) {
        copy->law = (word *)no_law;
        copy->memory_ring = spare.memory;
        copy->memory_size = copy->params_size = 0;
        copy->params_seen = copy->header[H_PARAMS];
        copy->memory_seen = copy->header[H_MEMORY_SET];
    }
    word *slot = l->states + l->header[H_STATES] % l->history * STATE_WORDS;
    for (int i = 0; i < STATE_WORDS; i += 8) __builtin_prefetch(slot + i, 1);
    return hf_turn(copy, l->t_datagram, size, l->received + l->period);
}

/* Receive the next datagram into t_datagram. The thread sleeps until shortly before the message is due, and warms up. With
   `busy_poll` it then asks for the message again and again: no waking of the thread adds to the latency. It sleeps again if
   the message is late. */
static ssize_t next_message(struct loop *l, struct sockaddr_in *from, word *received) {
    if (l->hot && l->period) {
        word due = l->received + l->period, early = l->busy_poll > WARM_UP ? l->busy_poll : WARM_UP;
        word asleep = due - early - clock_now(CLOCK_MONOTONIC);
        struct pollfd sock = {.fd = (int)l->sock, .events = POLLIN};
        struct timespec rest = {.tv_sec = asleep / 1000000000LL, .tv_nsec = asleep % 1000000000LL};
        if (asleep > 0 && ppoll(&sock, 1, &rest, NULL) == 0) hf_warm_up(l, (int)l->t_size);
        while (l->busy_poll && clock_now(CLOCK_MONOTONIC) < due + l->busy_poll) {
            ssize_t size = receive((int)l->sock, MSG_DONTWAIT, l->t_datagram, from, received);
            if (size >= 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) return size;
        }
    }
    return receive((int)l->sock, 0, l->t_datagram, from, received);
}

/* Receive and answer at most `turns` datagrams. A datagram that is handed back is in t_datagram, with its size, time and
   sender. */
int hf_run(struct loop *l, word turns, word *sender) {
    while (turns-- > 0) {
        struct sockaddr_in from;
        word received;
        ssize_t size = next_message(l, &from, &received);
        if (size < 0) {
            if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR || errno == ECONNREFUSED) return TIMEOUT;
            l->t_size = errno;
            return SOCKET_ERROR;
        }
        l->t_size = size;
        int known = from.sin_addr.s_addr == (uint32_t)l->address && ntohs(from.sin_port) == l->port;
        int answer = known ? hf_turn(l, l->t_datagram, (int)size, received) : HANDBACK;
        if (answer == HANDBACK) {
            l->t_received = received;
            sender[0] = from.sin_addr.s_addr;
            sender[1] = ntohs(from.sin_port);
            return HANDED_BACK;
        }
        if (answer == LAW) return CALL_LAW;
        if (answer > 0) reply(l, answer);
        hf_finish(l, clock_now(CLOCK_MONOTONIC));
        if (l->law_status != LAW_OK && !l->law_reported) return LAW_FAILED;
        if (l->header[H_STOP]) return CHECK;
    }
    return CHECK;
}
