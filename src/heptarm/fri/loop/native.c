/* The frequent turns of the FRI loop. Python is the authority: it handles every message that differs from the one
   before in more than numbers, and this file does what heptarm.rt.cycle, heptarm.fri.session, guard and policy would do
   with the others, word by word. A message that is not plain is handed back untouched.

   All members of `struct loop` have eight octets; heptarm.rt.native mirrors them. */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>

typedef int64_t word;
enum { HANDBACK = -1, LAW = -2 };
enum { TIMEOUT = 0, GIVEN_BACK = 1, LOOK = 2, BROKEN = 3, CALL_LAW = 4 };
enum { MONITORING_WAIT = 1, MONITORING_READY, COMMANDING_WAIT, COMMANDING_ACTIVE };
enum { POSITION = 1, WRENCH = 2, TORQUE = 3 };
enum { HOLD = 0, EXTRAPOLATE = 1, RAMP_DOWN = 2 };
enum { NOT_FINITE = 0, L_POSITION, L_VELOCITY, L_ACCELERATION, L_JERK, L_TORQUE, L_WRENCH };
enum { ANSWERED = 1, FILLED = 2, LIMITED = 4, BRAKING = 8 };
/* words of the shared header, a state and a command, as in heptarm.rt.layout */
enum { H_STATES = 0, H_COMMANDS = 1, H_STOP = 4, H_BEAT = 7, H_COUNTS = 16, H_LIMITED = 32, H_WORST = 81, H_ALLOWED = 130 };
enum { RECEIVED_ALL = 0, ANSWERED_ALL, MISSED = 6, POOR = 8, COMMANDED = 12, FILLED_ALL, LIMITED_ALL };
enum { STATE_WORDS = 122, S_TRACKING = 19, S_Q = 20, S_WRENCH = 62, S_POSE = 68, S_E1 = 75, S_SENT_Q = 76, S_POSES = 96 };
enum { COMMAND_WORDS = 31, COMMAND_SLOTS = 8, C_Q = 3, C_TAU = 10, C_WRENCH = 17 };
enum { BUFFER = 2048 };
#define SHARE 0.8
#define GRACE 50000000LL
#define SILENT_PERIODS 5
#define SILENT_LEAST 25000000.0
#define LONGEST 1000000000000000LL

struct loop {
    word *header, *latency, *jitter, *states, *commands, *outputs;
    word history, bins, sock, address, port;
    /* session */
    word hot, framed, echoes, state, quality, mode, sequence, received, period, multiplier, waiting, sent, reflected;
    word info[6];
    word robot_size, connection_size;
    word robot[8], connection[8];
    /* commanding */
    word is_started, is_ending, has_law, ticks, commands_seen, outputs_seen, started;
    word ipo_known, ipo_sequence;
    double ipo[7], slope[7];
    /* guard */
    double q[7], v[7], a[7], r[7], tau[7], wrench[6], low[7], high[7], top_v[7], top_a[7], top_j[7], near[7];
    double dq_max[7], ddq_max[7], dddq_max[7], tau_max[7], tau_step[7], wrench_max[6], wrench_step[6], reach, step;
    /* policy */
    word f_at, f_has_q, f_has_slope, f_has_tau, f_has_wrench, f_missing;
    double f_q[7], f_slope[7], f_tau[7], f_wrench[6], patience, over;
    /* what the law wants */
    double out_q[7], out_tau[7], out_wrench[6];
    /* this turn */
    word t_flags, t_received, t_answer, t_size;
    word t_stamp, t_known; /* t_known: bits of the arrays that are there */
    double t_tracking, t_q[42], t_wrench[6], t_pose[7], t_e1;
    uint8_t t_octets[BUFFER], t_reply[BUFFER];
};

word hf_size(void) { return sizeof(struct loop); }

/* ---------------------------------------------------------------------------------------------------- reading */

struct part {
    const uint8_t *at, *end;
};

static int varint(struct part *p, uint64_t *value) {
    *value = 0;
    for (int shift = 0; shift < 64 && p->at < p->end; shift += 7) {
        uint8_t octet = *p->at++;
        *value |= (uint64_t)(octet & 0x7f) << shift;
        if (octet < 0x80) return shift < 63 || octet < 2;
    }
    return 0;
}

/* The next field: its key, and its number or its octets. */
static int field(struct part *p, uint64_t *key, uint64_t *number, struct part *octets) {
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
    octets->at = p->at;
    p->at += size;
    octets->end = p->at;
    return 1;
}

/* Seconds and nanoseconds, and nothing else. */
static int stamp(struct part p, word *nanos) {
    uint64_t key, seconds, rest;
    struct part none;
    if (!field(&p, &key, &seconds, &none) || key != 8 || seconds >> 32) return 0;
    if (!field(&p, &key, &rest, &none) || key != 16 || rest >> 32 || p.at < p.end) return 0;
    *nanos = (word)(seconds * 1000000000u + rest);
    return 1;
}

/* A redundancy's strategy and value, and nothing else. */
static int redundancy(struct part p, double *value) {
    uint64_t key, strategy;
    struct part octets;
    if (!field(&p, &key, &strategy, &octets) || key != 8 || (strategy != 0 && strategy != 4)) return 0;
    if (!field(&p, &key, &strategy, &octets) || key != 17 || p.at < p.end) return 0;
    memcpy(value, octets.at, 8);
    return 1;
}

static int is_plain_name(struct part p) {
    if (p.end - p.at > 63) return 0;
    while (p.at < p.end)
        if (*p.at++ > 0x7f) return 0;
    return 1;
}

/* `count` doubles in field `tag`, packed or one by one, and nothing else but, for frames, a name and a stamp. */
static int doubles(struct part p, int tag, int count, int frame, double *into) {
    int found = 0, names = 0;
    word none;
    while (p.at < p.end) {
        uint64_t key, number;
        struct part one;
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

static int same(struct part p, const word *known, word size) {
    return p.end - p.at == size && !memcmp(p.at, known, size);
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

struct seen {
    uint64_t sequence, reflected;
};

/* Read a message into the t_ members; 0 if it is anything but plain. */
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
    l->t_stamp = -1;
    while (p.at < p.end) {
        if (!field(&p, &key, &number, &one) || (key & 7) != 2 || key > (5 << 3 | 2)) return 0;
        int tag = key >> 3;
        if (tags & 1 << tag) return 0;
        tags |= 1 << tag;
        if (tag == 2 && !same(one, l->robot, l->robot_size)) return 0;
        if (tag == 4 && !same(one, l->connection, l->connection_size)) return 0;
        if (tag == 2 || tag == 4) continue;
        int inner = 0;
        while (one.at < one.end) {
            struct part leaf;
            if (!field(&one, &key, &number, &leaf) || key >> 3 > 15 || inner & 1 << (key >> 3)) return 0;
            inner |= 1 << (key >> 3);
            if (tag == 1) {
                if (key == 8) id = number;
                else if (key == 16) seen->sequence = number;
                else if (key == 24) seen->reflected = number;
                else return 0;
            } else if (tag == 3) {
                int at = (int)(key >> 3);
                if ((key & 7) != 2) return 0;
                if (at <= 5) {
                    if (!doubles(leaf, 1, 7, 0, l->t_q + 7 * (at == 3 ? 4 : at > 3 ? at - 2 : at - 1))) return 0;
                    l->t_known |= 1 << (at == 3 ? 4 : at > 3 ? at - 2 : at - 1);
                } else if (at == 6) {
                    if (!doubles(leaf, 1, 6, 0, l->t_wrench)) return 0;
                } else if (at == 9) {
                    if (!doubles(leaf, 2, 7, 1, l->t_pose)) return 0;
                } else if (at == 10) {
                    if (!redundancy(leaf, &l->t_e1)) return 0;
                } else if (at == 15) {
                    if (!stamp(leaf, &l->t_stamp)) return 0;
                } else {
                    return 0;
                }
            } else {
                if (key == 10) {
                    if (!doubles(leaf, 1, 7, 0, l->t_q + 35)) return 0;
                    l->t_known |= 32;
                } else if (key == 10 << 3) {
                    if ((word)number != l->mode) return 0;
                } else if (key == 11 << 3) {
                    if ((word)number != l->info[0]) return 0;
                } else if (key == (12 << 3 | 1)) {
                    memcpy(&l->t_tracking, leaf.at, 8);
                } else if (key == 18) { /* the interpolator's pose and redundancy are not needed, but have to be legal */
                    double unused[7];
                    if (!doubles(leaf, 2, 7, 1, unused)) return 0;
                } else if (key == 26) {
                    double unused;
                    if (!redundancy(leaf, &unused)) return 0;
                } else {
                    return 0;
                }
            }
        }
        if (tag == 1 && inner != 14) return 0;
        if (tag == 5 && ((l->mode && !(inner & 1 << 10)) || (l->info[0] >= 0 && !(inner & 1 << 11)))) return 0;
    }
    if (id != 0x245142 || seen->sequence >> 32 || seen->reflected >> 32) return 0;
    if (!(tags & 1 << 4) || (!(tags & 1 << 2)) != (l->robot_size < 0)) return 0;
    if (!(tags & 1 << 5) && (l->mode || l->info[0] >= 0)) return 0;
    for (int array = 0; array <= 5; array += 5) {
        double sum = 0.0;
        if (!(l->t_known >> array & 1)) continue;
        for (int i = 0; i < 7; i++) sum += l->t_q[7 * array + i];
        if (!isfinite(sum)) return 0;
    }
    return 1;
}

/* ------------------------------------------------------------------------------------------------------ guard */

static double least(double a, double b) { return a < b ? a : b; }
static double most(double a, double b) { return a > b ? a : b; }

static double ramp(double room, double jerk) {
    if (room <= 0.0) return room;
    double n = (double)(word)((sqrt(1.0 + 8.0 * room / jerk) - 1.0) * 0.5);
    return n * jerk + (room - jerk * n * (n + 1) * 0.5) / (n + 1);
}

static double brake(double v, double a, double top, double jerk) {
    double target = v > 0.0 ? -ramp(v, jerk) : ramp(-v, jerk);
    return least(least(most(most(target, -top), a - jerk), top), a + jerk);
}

static double overrun(double v, double a, double top, double jerk) {
    double peak = v + a * a / (2.0 * jerk), way, rest;
    if (a >= 0.0)
        way = (v > 0.0 ? v : 0.0) * a / jerk + a * a * a / (3.0 * jerk * jerk);
    else if (v <= 0.0)
        return 0.0;
    else if (a * a >= 2.0 * jerk * v)
        return v * (1.0 - a / jerk);
    else
        way = a * (peak - a * a / (6.0 * jerk)) / jerk;
    if (peak <= 0.0) return 0.0;
    rest = peak * jerk <= top * top ? peak * sqrt(peak / jerk) : 0.5 * peak * (peak / top + top / jerk);
    return most(way + rest, 0.0);
}

static void limited(struct loop *l, int kind, int axis, double asked, double allowed) {
    int at = 7 * kind + axis;
    double *worst = (double *)l->header + H_WORST + at;
    l->header[H_LIMITED + at]++;
    l->t_flags |= LIMITED;
    if (fabs(asked) >= *worst) {
        *worst = fabs(asked);
        ((double *)l->header)[H_ALLOWED + at] = fabs(allowed);
    }
}

static void tell(struct loop *l, int i, double step, double wanted, double a) {
    double t = l->step;
    if (fabs(step) > l->top_v[i])
        limited(l, L_VELOCITY, i, step / t, l->dq_max[i]);
    else if (fabs(wanted) > l->top_a[i])
        limited(l, L_ACCELERATION, i, wanted / (t * t), l->ddq_max[i]);
    else
        limited(l, L_JERK, i, (wanted - a) / (t * t * t), l->dddq_max[i]);
}

static double bounded(struct loop *l, int i, double goal, double before, const double *ipo) {
    if (!isfinite(goal)) {
        limited(l, NOT_FINITE, i, 0.0, 0.0);
        return before;
    }
    double low = l->low[i], high = l->high[i], kept;
    if (ipo) {
        double lower = most(low, least(ipo[i] - l->reach, high));
        high = least(high, most(ipo[i] + l->reach, lower));
        low = lower;
    }
    kept = least(most(goal, low), high);
    if (kept != goal) limited(l, L_POSITION, i, goal, kept);
    return kept;
}

static double approach(struct loop *l, int i, double goal, double before) {
    double q = l->q[i], v = l->v[i], a = l->a[i], high = l->top_v[i], top = l->top_a[i], jerk = l->top_j[i], acc;
    double upper = least(least(a + jerk, top), ramp(high - v, jerk));
    double lower = most(most(a - jerk, -top), -ramp(high + v, jerk));
    double pace = least(most(goal - before, -high), high);
    double step = goal - q, wanted = step - v;
    if (lower <= wanted && wanted <= upper && fabs(step - pace) <= 0.25 * jerk) {
        acc = wanted;
    } else {
        tell(l, i, step, wanted, a);
        double sign = step >= pace ? 1.0 : -1.0;
        double ahead = sign * (step - pace), speed = sign * (v - pace), bent = sign * a;
        double full = sign > 0 ? upper : -lower, slow = sign > 0 ? lower : -upper;
        double soft = SHARE * top, gentle = SHARE * jerk;
        slow = least(most(brake(speed, bent, soft, gentle), slow), full);
        double room = ahead - speed - full - overrun(speed + full, full, soft, gentle);
        if (room >= 0.0) {
            acc = sign * full;
        } else {
            double rest = ahead - speed - slow - overrun(speed + slow, slow, soft, gentle);
            acc = sign * (rest <= 0.0 ? slow : slow + (full - slow) * rest / (rest - room));
        }
    }
    double speed = v + acc, there = q + speed;
    if (there + overrun(speed, acc, top, jerk) > l->high[i] || there - overrun(-speed, -acc, top, jerk) < l->low[i]) {
        double braking = brake(v, a, top, jerk);
        if (braking != acc && wanted == acc) tell(l, i, step, wanted, a);
        return braking;
    }
    return acc;
}

static void position(struct loop *l, const double *wish, const double *ipo) {
    for (int i = 0; i < 7; i++) {
        double now = l->q[i], speed = l->v[i], acc;
        if (!wish) {
            acc = brake(speed, l->a[i], l->top_a[i], l->top_j[i]);
            l->v[i] = speed + acc;
            l->a[i] = acc;
            l->q[i] = l->r[i] = now + l->v[i];
            continue;
        }
        double goal = wish[i], before = l->r[i];
        if (!(l->low[i] <= goal && goal <= l->high[i]) || ipo) goal = bounded(l, i, goal, before, ipo);
        l->r[i] = goal;
        double step = goal - now, jerk = l->top_j[i];
        acc = step - speed;
        if (fabs(4.0 * (step - goal + before)) <= jerk && fabs(acc - l->a[i]) <= jerk &&
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

static void slew(struct loop *l, double *last, const double *wish, const double *limit, const double *step, int size, int kind) {
    for (int i = 0; i < size; i++) {
        double kept = last[i];
        if (isfinite(wish[i])) {
            kept = least(most(wish[i], -limit[i]), limit[i]);
            if (kept != wish[i]) limited(l, kind, i, wish[i], limit[i]);
        } else {
            limited(l, NOT_FINITE, i, 0.0, 0.0);
        }
        last[i] = least(most(kept, last[i] - step[i]), last[i] + step[i]);
    }
}

/* ----------------------------------------------------------------------------------------------------- policy */

static void take_command(struct loop *l) {
    word count = __atomic_load_n(&l->header[H_COMMANDS], __ATOMIC_ACQUIRE);
    if (count == l->commands_seen || count == 0) return;
    word copy[COMMAND_WORDS], *slot = l->commands + (count - 1) % COMMAND_SLOTS * COMMAND_WORDS;
    if (__atomic_load_n(slot, __ATOMIC_ACQUIRE) != 2 * (count - 1) + 2) return;
    memcpy(copy, slot, sizeof copy);
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    if (__atomic_load_n(slot, __ATOMIC_RELAXED) != 2 * (count - 1) + 2) return;
    l->commands_seen = count;
    word when = copy[1], given = copy[2];
    double *numbers = (double *)copy;
    if (when + GRACE < l->started) return;
    if (given & 1) {
        double gap = (double)(when - l->f_at) * 1e-9;
        l->f_has_slope = l->f_has_q && 0.0 < gap && gap <= l->patience;
        for (int i = 0; i < 7; i++) {
            if (l->f_has_slope) l->f_slope[i] = (numbers[C_Q + i] - l->f_q[i]) / gap;
            l->f_q[i] = numbers[C_Q + i];
        }
        l->f_has_q = 1;
    }
    if (given & 2) memcpy(l->f_tau, numbers + C_TAU, 56), l->f_has_tau = 1;
    if (given & 4) memcpy(l->f_wrench, numbers + C_WRENCH, 48), l->f_has_wrench = 1;
    l->f_at = when;
}

static const double *wish_now(struct loop *l, const double *ipo, double *buffer) {
    if (!l->f_at) return ipo;
    double age = (double)(l->t_received - l->f_at) * 1e-9, late = age - l->patience;
    if (late > 0.0) l->t_flags |= FILLED;
    if (l->f_missing != HOLD && late > (l->f_missing == EXTRAPOLATE ? l->over : 0.0)) return NULL;
    if (!l->f_has_q) return ipo;
    if (l->f_missing != EXTRAPOLATE || !l->f_has_slope) return l->f_q;
    for (int i = 0; i < 7; i++) buffer[i] = l->f_q[i] + l->f_slope[i] * age;
    return buffer;
}

static double share_left(struct loop *l) {
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
    for (int i = 0; i < 7; i++, at += 9) {
        *at = 9;
        memcpy(at + 1, values + i, 8);
    }
    return at;
}

static int write_command(struct loop *l, const double *q, const double *tau, const double *wrench) {
    uint8_t *begin = l->t_reply + (l->framed ? 4 : 0), *at = begin + 2;
    at = put_varint((*at = 8, at + 1), 0x34001);
    at = put_varint((*at = 16, at + 1), (uint64_t)l->sent);
    at = put_varint((*at = 24, at + 1), (uint64_t)l->sequence);
    begin[0] = 10;
    begin[1] = (uint8_t)(at - begin - 2);
    if (q) {
        *at++ = 18;
        at = put_varint(at, 65 + (wrench ? 52 : 0) + (tau ? 65 : 0));
        at = put_joints(at, 10, q);
        if (wrench) {
            memcpy(at, "\x12\x32\x0a\x30", 4);
            memcpy(at + 4, wrench, 48);
            at += 52;
        }
        if (tau) at = put_joints(at, 26, tau);
    }
    if (l->framed) {
        uint32_t length = (uint32_t)(at - begin), sum = crc(begin, (int)length);
        memcpy(l->t_reply, &length, 4);
        memcpy(at, &sum, 4);
        at += 4;
    }
    l->sent = (l->sent + 1) & 0xffffffff;
    l->waiting = 0;
    l->header[H_COUNTS + ANSWERED_ALL]++;
    l->t_answer = 1;
    return (int)(at - l->t_reply);
}

static const double zeros[7];

static int command(struct loop *l, const double *wish, const double *tau, const double *wrench) {
    const double *ipo = l->t_q + 35;
    if (!wish) l->t_flags |= BRAKING;
    position(l, wish, isinf(l->reach) ? NULL : ipo);
    if (l->mode == TORQUE) slew(l, l->tau, tau, l->tau_max, l->tau_step, 7, L_TORQUE);
    if (l->mode == WRENCH) slew(l, l->wrench, wrench, l->wrench_max, l->wrench_step, 6, L_WRENCH);
    l->header[H_COUNTS + LIMITED_ALL] += (l->t_flags & LIMITED) != 0;
    l->header[H_COUNTS + FILLED_ALL] += (l->t_flags & FILLED) != 0;
    l->header[H_COUNTS + COMMANDED]++;
    return write_command(l, l->q, l->mode == TORQUE ? l->tau : NULL, l->mode == WRENCH ? l->wrench : NULL);
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
    word words[18] = {l->t_received, l->sequence, l->t_stamp < 0 ? 0 : l->t_stamp, l->state, l->quality, l->mode,
                      l->info[0], l->info[1], l->info[2], l->info[3], l->info[4], l->period, l->info[5], 0,
                      l->t_flags, l->reflected, l->sent, active && l->ticks > 0 ? l->ticks : 0};
    memcpy(slot + 1, words, sizeof words);
    numbers[S_TRACKING] = l->t_tracking;
    /* arrays of t_q: measured, torque, commanded torque, external torque, commanded position, interpolator */
    for (int array = 0; array < 6; array++)
        for (int i = 0; i < 7; i++) numbers[S_Q + 7 * array + i] = l->t_known >> array & 1 ? l->t_q[7 * array + i] : NAN;
    for (int i = 0; i < 6; i++) numbers[S_WRENCH + i] = isnan(l->t_wrench[0]) ? NAN : l->t_wrench[i];
    for (int i = 0; i < 7; i++) numbers[S_POSE + i] = isnan(l->t_pose[0]) ? NAN : l->t_pose[i];
    numbers[S_E1] = l->t_e1;
    for (int i = 0; i < 7; i++) {
        numbers[S_SENT_Q + i] = active && l->t_answer ? l->q[i] : NAN;
        numbers[S_SENT_Q + 7 + i] = active && l->t_answer && l->mode == TORQUE ? l->tau[i] : NAN;
        if (i < 6) numbers[S_SENT_Q + 14 + i] = active && l->t_answer && l->mode == WRENCH ? l->wrench[i] : NAN;
    }
    for (int i = S_POSES; i < STATE_WORDS; i++) numbers[i] = NAN; /* sessions that command poses are Python's */
}

static word *open_slot(struct loop *l) {
    word tick = l->header[H_STATES], *slot = l->states + tick % l->history * STATE_WORDS;
    __atomic_store_n(slot, 2 * tick + 1, __ATOMIC_RELAXED);
    __atomic_thread_fence(__ATOMIC_RELEASE);
    return slot;
}

/* Take a datagram: HANDBACK, LAW (then hf_answer has to follow), or the size of the answer in t_reply, 0 for none. */
int hf_turn(struct loop *l, const uint8_t *data, int size, word received) {
    struct seen seen;
    int commanding = l->state == COMMANDING_ACTIVE, waiting = l->state == COMMANDING_WAIT;
    if (!l->hot || !read_message(l, data, size, &seen)) return HANDBACK;
    if (seen.sequence != (((uint64_t)l->sequence + 1) & 0xffffffff)) return HANDBACK;
    if ((commanding || waiting) && !(l->t_known & 32)) return HANDBACK;
    if (commanding) {
        word gap = received - l->received;
        if (!l->is_started || *l->outputs != l->outputs_seen) return HANDBACK;
        if ((double)gap > most(SILENT_PERIODS * (double)l->period * (double)l->multiplier, SILENT_LEAST)) return HANDBACK;
    }
    /* from here on nothing is handed back */
    word *counts = l->header + H_COUNTS;
    counts[RECEIVED_ALL]++;
    counts[POOR + l->quality]++;
    if (l->period) {
        word off = received - l->received - l->period;
        count_duration(l, l->jitter, off < 0 ? -off : off);
    }
    if (l->reflected >= 0 && (word)seen.reflected > l->reflected && (word)seen.reflected <= l->sent)
        counts[MISSED] += (word)seen.reflected - l->reflected - 1;
    l->reflected = (word)seen.reflected;
    l->sequence = (word)seen.sequence;
    l->received = l->t_received = received;
    l->t_flags = l->t_answer = 0;
    l->waiting++;
    if (commanding) {
        l->ticks++;
    } else if (waiting) {
        double gap = l->ipo_known ? (double)((word)seen.sequence - l->ipo_sequence) * (double)l->period * 1e-9 : 0.0;
        for (int i = 0; i < 7; i++) {
            l->slope[i] = gap > 0.0 ? (l->t_q[35 + i] - l->ipo[i]) / gap : 0.0;
            l->ipo[i] = l->t_q[35 + i];
        }
        l->ipo_known = 1;
        l->ipo_sequence = l->sequence;
    }
    if (l->waiting < l->multiplier) return 0;
    if (!commanding && !waiting) return write_command(l, l->echoes && l->t_known & 16 ? l->t_q + 28 : NULL, NULL, NULL);
    if (waiting)
        return write_command(l, l->t_q + 35, l->mode == TORQUE ? zeros : NULL, l->mode == WRENCH ? zeros : NULL);
    if (l->is_ending) return command(l, NULL, zeros, zeros);
    if (l->has_law) {
        memcpy(l->out_q, l->t_q + 35, 56);
        memset(l->out_tau, 0, sizeof l->out_tau);
        memset(l->out_wrench, 0, sizeof l->out_wrench);
        fill_state(l, open_slot(l));
        return LAW;
    }
    double buffer[7], tau[7], wrench[6], share;
    take_command(l);
    const double *wish = wish_now(l, l->t_q + 35, buffer);
    share = share_left(l);
    for (int i = 0; i < 7; i++) {
        tau[i] = l->f_has_tau ? share * l->f_tau[i] : 0.0;
        if (i < 6) wrench[i] = l->f_has_wrench ? share * l->f_wrench[i] : 0.0;
    }
    return command(l, wish, tau, wrench);
}

/* The law has spoken (or failed: then the arm brakes). */
int hf_answer(struct loop *l) {
    if (l->is_ending) return command(l, NULL, zeros, zeros);
    return command(l, l->out_q, l->out_tau, l->out_wrench);
}

/* Publish the turn whose answer has left at `now`. */
void hf_finish(struct loop *l, word now) {
    word tick = l->header[H_STATES], *slot = open_slot(l);
    if (l->t_answer) {
        l->t_flags |= ANSWERED;
        count_duration(l, l->latency, now - l->received);
    }
    fill_state(l, slot);
    slot[14] = l->t_answer ? now - l->received : 0;
    __atomic_store_n(slot, 2 * tick + 2, __ATOMIC_RELEASE);
    __atomic_store_n(&l->header[H_STATES], tick + 1, __ATOMIC_RELEASE);
    l->header[H_BEAT] = now;
}

static word clock_now(clockid_t clock) {
    struct timespec t;
    clock_gettime(clock, &t);
    return t.tv_sec * 1000000000LL + t.tv_nsec;
}

static void reply(struct loop *l, int size) {
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons((uint16_t)l->port)};
    to.sin_addr.s_addr = (uint32_t)l->address;
    sendto((int)l->sock, l->t_reply, (size_t)size, 0, (struct sockaddr *)&to, sizeof to);
}

/* After the law: answer, send, publish. */
void hf_send(struct loop *l) {
    reply(l, hf_answer(l));
    hf_finish(l, clock_now(CLOCK_MONOTONIC));
}

/* Wait and answer for at most `turns` datagrams. The datagram that is handed back is in t_octets, with its size, time
   and sender. */
int hf_run(struct loop *l, word turns, word *sender) {
    while (turns-- > 0) {
        struct sockaddr_in from;
        char control[128];
        struct iovec part = {l->t_octets, BUFFER};
        struct msghdr message = {.msg_name = &from, .msg_namelen = sizeof from, .msg_iov = &part, .msg_iovlen = 1,
                                 .msg_control = control, .msg_controllen = sizeof control};
        ssize_t size = recvmsg((int)l->sock, &message, 0);
        if (size < 0) {
            if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR || errno == ECONNREFUSED) return TIMEOUT;
            l->t_size = errno;
            return BROKEN;
        }
        word received = clock_now(CLOCK_MONOTONIC);
        for (struct cmsghdr *head = CMSG_FIRSTHDR(&message); head; head = CMSG_NXTHDR(&message, head)) {
            struct timespec stamp;
            if (head->cmsg_level != SOL_SOCKET || head->cmsg_type != SCM_TIMESTAMPNS) continue;
            memcpy(&stamp, CMSG_DATA(head), sizeof stamp);
            word age = clock_now(CLOCK_REALTIME) - stamp.tv_sec * 1000000000LL - stamp.tv_nsec;
            if (age >= 0 && age < 10000000000LL) received -= age;
        }
        int known = from.sin_addr.s_addr == (uint32_t)l->address && ntohs(from.sin_port) == l->port;
        int answer = known ? hf_turn(l, l->t_octets, (int)size, received) : HANDBACK;
        if (answer == HANDBACK) {
            l->t_size = size;
            l->t_received = received;
            sender[0] = from.sin_addr.s_addr;
            sender[1] = ntohs(from.sin_port);
            return GIVEN_BACK;
        }
        if (answer == LAW) return CALL_LAW;
        if (answer > 0) reply(l, answer);
        hf_finish(l, clock_now(CLOCK_MONOTONIC));
        if (l->header[H_STOP]) return LOOK;
    }
    return LOOK;
}
