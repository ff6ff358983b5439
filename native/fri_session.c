/* The session of a controller as its client sees it: version, state, quality, counters, lost messages.

   States are the controller's (IDLE, MONITORING_WAIT, MONITORING_READY, COMMANDING_WAIT, COMMANDING_ACTIVE); the client follows
   each message. What it decides itself is which datagrams count:

   - a datagram that is no message, or one that cannot be true (a position that no robot has or could have reached, an impossible
     period), is counted and reported, and costs this cycle;
   - a message that was overtaken or came twice is ignored;
   - a counter that goes back further is a new session, and so is a message of another version.

   Everything that happens is an event in the shared memory; `trouble` keeps why there is no session until a good message comes. */
#include <stdarg.h>
#include <stdio.h>

#include "fri.h"

/* Largest decrease of the counter that counts as a reordered message; a larger one is a restart of the controller. */
enum { MAX_REORDERED = 64, MAX_PERIOD_MS = 100, MAX_MULTIPLIER = 100 };
/* After this long without a message, a lower counter always means a new session [ns]. */
#define MAX_GAP 500000000LL
/* Largest coordinate of a flange pose [mm], and deviation of a quaternion's norm from 1. */
#define MAX_COORDINATE 10000.0
#define MAX_NORM_ERROR 0.05
/* An interpolator moves at most this much faster than an axis may, and this far beyond what that allows [rad]. */
#define REACH_FACTOR 1.5
#define REACH_MARGIN 0.01
#define WRAP 0xffffffffLL

static const char *const state_names[] = {"IDLE", "MONITORING_WAIT", "MONITORING_READY", "COMMANDING_WAIT", "COMMANDING_ACTIVE"};
static const char *const quality_names[] = {"POOR", "FAIR", "GOOD", "EXCELLENT"};
static const char *const safety_names[] = {"NORMAL_OPERATION", "STOP_0", "STOP_1", "STOP_2"};
static const char *const mode_names[] = {"NO_COMMAND", "POSITION", "WRENCH", "TORQUE", "CARTESIAN_POSE"};

/* Publish an event. */
void fri_report(struct fri_loop *l, word kind, word now, const char *format, ...) {
    word tick = l->header[H_EVENTS], *slot = l->seam->events + tick % EVENT_SLOTS * EVENT_WORDS;
    char text[TEXT];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    __atomic_store_n(slot, 2 * tick + 1, __ATOMIC_RELAXED);
    __atomic_thread_fence(__ATOMIC_RELEASE);
    slot[1] = now;
    slot[2] = kind;
    memset(slot + 3, 0, EVENT_TEXT);
    size_t size = strlen(text);
    memcpy(slot + 3, text, size < EVENT_TEXT ? size : EVENT_TEXT);
    __atomic_store_n(slot, 2 * tick + 2, __ATOMIC_RELEASE);
    __atomic_store_n(&l->header[H_EVENTS], tick + 1, __ATOMIC_RELEASE);
}

/* Publish why there is no session; empty: there is one. */
void fri_set_trouble(struct fri_loop *l, const char *text) {
    if (!strcmp(l->session.trouble, text)) return;
    snprintf(l->session.trouble, TEXT, "%s", text);
    word *note = l->seam->trouble;
    __atomic_store_n(note, note[0] | 1, __ATOMIC_RELAXED);
    __atomic_thread_fence(__ATOMIC_RELEASE);
    note[1] = (word)strlen(l->session.trouble);
    memcpy(note + 2, l->session.trouble, (size_t)note[1]);
    __atomic_store_n(note, note[0] + 1, __ATOMIC_RELEASE);
}

/* Forget the controller, for example after a change of its address; the counts stay. */
void fri_session_restart(struct session *s) {
    s->version = ABSENT;
    s->has_message = s->is_due = 0;
    s->state = IDLE;
    s->quality = POOR;
    s->mode = NO_COMMAND;
    s->safety = ABSENT;
    s->period = s->received = s->waiting = s->sequence = 0;
    s->multiplier = 1;
    s->reflected = s->sent - 1;
    s->began++;
}

static void enter(struct fri_loop *l, word state, word now) {
    struct session *s = &l->session;
    if (state == s->state) return;
    fri_report(l, KIND_STATE, now, "%s -> %s", state_names[s->state], state_names[state]);
    s->state = state;
}

/* ----------------------------------------------------------------------------------------------- what may not be true */

__attribute__((format(printf, 2, 3))) static int implausible(struct message *m, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(m->why, TEXT, format, arguments);
    va_end(arguments);
    return 0;
}

/* A number for a text: a NaN without its sign. */
static double shown(double value) { return isnan(value) ? NAN : value; }

static int check_range(struct fri_loop *l, struct message *m, int array, const char *name) {
    if (!(m->known & BIT_OF(array))) return 1;
    const double *values = m->joints[PLACE_OF(array)], *low = l->seam->lowest, *high = l->seam->highest;
    for (int i = 0; i < AXES; i++)
        if (!(low[i] - OVERRUN <= values[i] && values[i] <= high[i] + OVERRUN))
            return implausible(m, "FRI message: the %s position of A%d must be in [%.4g, %.4g] rad, got %.4g rad: the datagram is "
                                  "damaged, or the client's model is another robot",
                               name, i + 1, low[i], high[i], shown(values[i]));
    return 1;
}

/* Whether a message is of the session that the last one was of, as far as its counter and the time say. */
static int goes_on(const struct session *s, const struct message *m, word now) {
    word steps = (m->sequence - s->sequence) & WRAP;
    return s->has_message && s->state != IDLE && m->has_link && m->state != IDLE && steps <= WRAP / 2 && now - s->received <= MAX_GAP;
}

/* The periods of a session never change. */
static int check_periods(struct fri_loop *l, struct message *m, word now) {
    const struct session *s = &l->session;
    word period = m->period_ms > 0 ? m->period_ms : 0, multiplier = m->multiplier > 1 ? m->multiplier : 1;
    if (m->period_ms > MAX_PERIOD_MS)
        return implausible(m, "FRI message: the send period must be in [1, %d] ms, got %lld ms: the datagram is damaged", MAX_PERIOD_MS,
                           (long long)m->period_ms);
    if (m->multiplier > MAX_MULTIPLIER)
        return implausible(m, "FRI message: the receive multiplier must be in [1, %d], got %lld: the datagram is damaged",
                           MAX_MULTIPLIER, (long long)m->multiplier);
    if (!goes_on(s, m, now) || (period * 1000000 == s->period && multiplier == s->multiplier)) return 1;
    return implausible(m, "FRI message: the session has %lld ms and %lld messages per answer, got %lld ms and %lld: the datagram is damaged",
                       (long long)s->period / 1000000, (long long)s->multiplier, (long long)period, (long long)multiplier);
}

/* Whether the interpolator can have moved so far since the last message that was mirrored. Only then is it sent back as it is;
   while commands are effective the guard limits what follows from it, and it may jump where a motion ends. */
static int check_reach(struct fri_loop *l, struct message *m, word now) {
    struct session *s = &l->session;
    word steps = (m->sequence - s->sequence) & WRAP, elapsed = now - l->reach_from;
    int mirrors = l->reach_from && s->state == COMMANDING_WAIT && m->state == COMMANDING_WAIT;
    if (!mirrors || !s->has_message || steps > WRAP / 2 || !(m->known & BIT_OF(S_Q_IPO))) return 1;
    if (steps <= MAX_LOST && steps * s->period > elapsed) elapsed = steps * s->period;
    double time = 1e-9 * (double)(elapsed + s->period);
    for (int i = 0; i < AXES; i++) {
        double step = fabs(m->joints[PLACE_OF(S_Q_IPO)][i] - l->reach_ipo[i]);
        if (step > REACH_FACTOR * l->seam->fastest[i] * time + REACH_MARGIN)
            return implausible(m, "FRI message: the interpolated position of A%d moved by %.4g rad within %.4g s, which no axis can: the "
                                  "datagram is damaged",
                               i + 1, step, time);
    }
    return 1;
}

/* Check what the loop relies on and what an answer may send back. */
static int check_plausible(struct fri_loop *l, struct message *m, word now) {
    double sum = 0.0;
    for (int i = 0; i < AXES; i++) sum += m->known & BIT_OF(S_Q) ? m->joints[PLACE_OF(S_Q)][i] : 0.0;
    if (!isfinite(sum)) return implausible(m, "FRI message: joint positions must be finite; the datagram is damaged");
    for (int i = 0; i < AXES && m->known & BIT_OF(S_Q); i++) { /* it may be beyond a limit, but never so far: velocities follow from it */
        double q = m->joints[PLACE_OF(S_Q)][i];
        if (fabs(q) > 2.0 * M_PI)
            return implausible(m, "FRI message: the measured position of A%d must be in [-2π, 2π] rad, got %.4g rad: the datagram is damaged",
                               i + 1, q);
    }
    if (m->has_link && !check_periods(l, m, now)) return 0;
    if (!check_range(l, m, S_Q_IPO, "interpolated") || !check_range(l, m, S_Q_CMD, "commanded")) return 0;
    if (!check_reach(l, m, now)) return 0;
    if (m->mode != CARTESIAN_POSE) return 1; /* only then is a pose sent back */
    if (m->ipo_pose.is_given) {
        const double *v = m->ipo_pose.values;
        double size = sqrt(v[3] * v[3] + v[4] * v[4] + v[5] * v[5] + v[6] * v[6]);
        int is_near = fabs(v[0]) <= MAX_COORDINATE && fabs(v[1]) <= MAX_COORDINATE && fabs(v[2]) <= MAX_COORDINATE;
        if (!is_near || !(fabs(size - 1.0) <= MAX_NORM_ERROR))
            return implausible(m, "FRI message: the interpolated pose must be within %g mm with a quaternion of norm 1, got (%g, %g, %g, "
                                  "%g, %g, %g, %g): the datagram is damaged",
                               MAX_COORDINATE, shown(v[0]), shown(v[1]), shown(v[2]), shown(v[3]), shown(v[4]), shown(v[5]), shown(v[6]));
    }
    if (m->ipo_strategy != ABSENT && !(fabs(m->ipo_e1) <= 2.0 * M_PI))
        return implausible(m, "FRI message: the interpolated redundancy angle must be in [-2π, 2π] rad, got %.4g rad: the datagram is "
                              "damaged",
                           shown(m->ipo_e1));
    return 1;
}

/* ---------------------------------------------------------------------------------------------------------- receiving */

/* Read the first message of a controller; find or check its version. */
static int begin(struct fri_loop *l, const uint8_t *data, int size, struct message *m, word now) {
    struct session *s = &l->session;
    int version = l->seam->version == ABSENT ? fri_recognise(data, size, m->why) : (int)l->seam->version;
    if (version == ABSENT || !fri_decode(data, size, version, m)) return 0;
    const char *spoken = NULL;
    if (fri_has_quaternions(version) && m->known & BIT_OF(S_Q_CMD))
        spoken = "1.x";
    else if (!fri_has_quaternions(version) && (m->has_monitored_pose || m->has_monitored_redundancy || m->ipo_pose.is_given))
        spoken = "2.5";
    if (spoken) {
        snprintf(m->why, TEXT, "the controller speaks FRI %s, this client is set to %s: set the client to the controller's version, or "
                               "leave the version out to recognise it",
                 spoken, fri_version_names[version]);
        return 0;
    }
    if (version != s->version) fri_report(l, KIND_VERSION, now, "the controller speaks FRI %s", fri_version_names[version]);
    s->version = version;
    return 1;
}

enum { NO_MESSAGE, IMPLAUSIBLE, LEGAL };

static int read_datagram(struct fri_loop *l, const uint8_t *data, int size, struct message *m, word now) {
    struct session *s = &l->session;
    char why[TEXT];
    if (s->version == ABSENT) {
        if (!begin(l, data, size, m, now)) return NO_MESSAGE;
    } else if (!fri_decode(data, size, s->version, m)) {
        if (l->seam->version != ABSENT) return NO_MESSAGE;
        /* the controller may have started another application with another version */
        int version = fri_recognise(data, size, why);
        if (version == ABSENT) memcpy(m->why, why, TEXT);
        if (version == ABSENT || version == s->version || !begin(l, data, size, m, now)) return NO_MESSAGE;
    }
    return check_plausible(l, m, now) ? LEGAL : IMPLAUSIBLE;
}

/* Report a datagram that is no message; keep the likely cause as trouble until the next message. */
static void diagnose(struct fri_loop *l, int what, const uint8_t *data, int size, const struct message *m, word now) {
    struct session *s = &l->session;
    char unused[TEXT], trouble[2 * TEXT];
    int spoken = what == IMPLAUSIBLE ? ABSENT : fri_recognise(data, size, unused);
    int expected = l->seam->version != ABSENT ? (int)l->seam->version : s->version;
    if (spoken == ABSENT) {
        fri_report(l, KIND_MALFORMED, now, "%s", m->why);
        if (what == IMPLAUSIBLE) {
            fri_set_trouble(l, m->why);
        } else if (!s->has_message) {
            snprintf(trouble, sizeof trouble,
                     "%s; datagrams arrive, but none is a message of FRI 1.11 to 2.7: likely cause: the controller speaks another "
                     "version, or another program sends to this port",
                     m->why);
            trouble[TEXT - 1] = 0;
            fri_set_trouble(l, trouble);
        }
        return;
    }
    snprintf(trouble, sizeof trouble, "%s", m->why);
    if (!strstr(trouble, "speaks FRI") && expected != ABSENT && spoken != expected)
        snprintf(trouble, sizeof trouble, "%s; likely cause: the controller speaks FRI %s, this client is set to %s", m->why,
                 fri_version_names[spoken], fri_version_names[expected]);
    trouble[TEXT - 1] = 0;
    if (!strcmp(s->trouble, trouble)) return; /* once, not in every cycle */
    fri_set_trouble(l, trouble);
    fri_report(l, KIND_WRONG_VERSION, now, "%s", trouble);
}

static void count_duration(word *histogram, word nanos) {
    word micros = nanos > 0 ? nanos / 1000 : 0;
    histogram[micros < BINS ? micros : BINS - 1]++;
    if (nanos > histogram[BINS]) histogram[BINS] = nanos < LONGEST ? nanos : LONGEST;
}

/* Note that the answer was sent. */
void fri_count_latency(struct fri_loop *l, word now) { count_duration(l->header + H_LATENCY, now - l->session.received); }

/* Whether a message is newer than the last; count lost, duplicated and reordered ones. */
static int count(struct fri_loop *l, const struct message *m, word now) {
    struct session *s = &l->session;
    word *counts = l->header + H_COUNTS;
    counts[COUNT_RECEIVED]++;
    if (!s->has_message) return 1;
    word step = (m->sequence - s->sequence) & WRAP, interval = now - s->received;
    if (step == 0 && interval < MAX_GAP) {
        counts[COUNT_DUPLICATED]++;
        fri_report(l, KIND_DUPLICATED, now, "message %lld received twice", (long long)m->sequence);
        return 0;
    }
    if (0 < step && step <= WRAP / 2) {
        if (step > 1) {
            counts[COUNT_LOST] += step - 1;
            fri_report(l, KIND_LOST, now, "%lld messages before %lld are lost", (long long)step - 1, (long long)m->sequence);
        }
        word off = interval - step * s->period;
        if (s->period && step <= MAX_REORDERED) count_duration(l->header + H_JITTER, off < 0 ? -off : off);
        return 1;
    }
    if (WRAP + 1 - step <= MAX_REORDERED && interval < MAX_GAP && s->state != IDLE) {
        counts[COUNT_REORDERED]++;
        if (counts[COUNT_LOST] > 0) counts[COUNT_LOST]--;
        fri_report(l, KIND_REORDERED, now, "message %lld received after %lld", (long long)m->sequence, (long long)s->sequence);
        return 0;
    }
    counts[COUNT_RESTARTS]++;
    s->reflected = s->sent - 1; /* newest answer of this session that the controller has received */
    s->waiting = 0;
    s->began++;
    fri_report(l, KIND_RESTARTED, now, "the controller's counter restarts at %lld: a new session", (long long)m->sequence);
    enter(l, IDLE, now);
    return 1;
}

/* Detect a change of command mode or safety state, and answers that the controller missed. */
static void detect_changes(struct fri_loop *l, const struct message *m, word now) {
    struct session *s = &l->session;
    if (s->reflected < m->reflected && m->reflected <= s->sent) {
        l->header[H_COUNTS + COUNT_MISSED] += m->reflected - s->reflected - 1;
        s->reflected = m->reflected;
    }
    if (m->safety != s->safety) {
        if (m->safety != ABSENT && (s->safety != ABSENT || m->safety != NORMAL_OPERATION))
            fri_report(l, KIND_SAFETY, now, "safety state %s", safety_names[m->safety]);
        s->safety = m->safety;
    }
    word mode = m->mode == ABSENT ? NO_COMMAND : m->mode;
    if (mode != s->mode) {
        fri_report(l, KIND_COMMAND_MODE, now, "client command mode %s -> %s", mode_names[s->mode], mode_names[mode]);
        s->mode = mode;
    }
}

/* Take a datagram of the controller; 0 if it is ignored. The message then is the newest one, in `l->message`. */
int fri_receive(struct fri_loop *l, const uint8_t *data, int size, word now) {
    struct session *s = &l->session;
    struct message *m = l->message == l->messages ? l->messages + 1 : l->messages;
    s->is_due = 0;
    int what = read_datagram(l, data, size, m, now);
    if (what != LEGAL) {
        l->header[H_COUNTS + COUNT_MALFORMED]++;
        diagnose(l, what, data, size, m, now);
        return 0;
    }
    if (!count(l, m, now)) return 0;
    s->multiplier = 1;
    if (!m->has_link) { /* a legal message of a controller without a session */
        enter(l, IDLE, now);
    } else {
        s->period = m->period_ms > 0 ? m->period_ms * 1000000 : 0;
        s->multiplier = m->multiplier > 1 ? m->multiplier : 1;
        l->header[H_COUNTS + COUNT_POOR + m->quality]++;
        enter(l, m->state, now);
        if (m->quality != s->quality) {
            fri_report(l, KIND_QUALITY, now, "quality %s -> %s", quality_names[s->quality], quality_names[m->quality]);
            s->quality = m->quality;
        }
    }
    detect_changes(l, m, now);
    l->message = m;
    s->has_message = 1;
    s->sequence = m->sequence;
    s->received = now;
    fri_set_trouble(l, "");
    s->waiting = s->state == IDLE ? 0 : s->waiting + 1;
    s->is_due = s->state != IDLE && s->waiting >= s->multiplier;
    return 1;
}
