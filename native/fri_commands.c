/* What the user's process commands: the newest command, the policy for missing ones, outputs and frames.

   A command is absolute: it means a place, and the place belongs to the session in which it was computed. Each one therefore has
   the number of the session (`epoch`) that its sender had seen. One that is older is not executed: the arm is held, the loop
   reports it once, and counts it. */
#include <stdio.h>

#include "fri.h"

/* ------------------------------------------------------------------------------------------------------------ policy */

/* Start without a command; the interpolator is mirrored until the first one. */
void fri_commands_start(struct commands *c) { memset(c, 0, sizeof *c); }

static void differ(const double *new, double *old, double *slope, int size, double gap, int is_stream) {
    for (int i = 0; i < size; i++) {
        if (is_stream) slope[i] = (new[i] - old[i]) / gap;
        old[i] = new[i];
    }
}

static void take(struct commands *c, const double *numbers, word when, word given, double patience) {
    double gap = (double)(when - c->at) * 1e-9;
    /* only two commands of one stream give its velocity, not two with a pause between them */
    int is_stream = 0.0 < gap && gap <= patience;
    if (given & GIVEN_Q) {
        c->has_slope = c->has_q && is_stream;
        differ(numbers + C_Q, c->q, c->slope, AXES, gap, c->has_slope);
        c->has_q = 1;
    }
    if (given & GIVEN_POSE) {
        double between[6];
        c->has_twist = c->has_pose && is_stream;
        if (c->has_twist) {
            pose_between(c->pose, numbers + C_POSE, between);
            for (int i = 0; i < 6; i++) c->twist[i] = between[i] / gap;
        }
        memcpy(c->pose, numbers + C_POSE, sizeof c->pose);
        c->has_pose = 1;
    }
    if (given & GIVEN_TAU) memcpy(c->tau, numbers + C_TAU, sizeof c->tau), c->has_tau = 1;
    if (given & GIVEN_WRENCH) memcpy(c->wrench, numbers + C_WRENCH, sizeof c->wrench), c->has_wrench = 1;
    if (given & GIVEN_E1) c->e1 = numbers[C_E1], c->has_e1 = 1;
    c->at = when;
}

/* Time for which a command is fresh [s]: a program that sends one for each command period is not late by that alone. */
static double patience_of(const struct fri_loop *l) {
    return most(l->seam->patience, 1.5e-9 * (double)(l->session.period * l->session.multiplier));
}

/* Read the newest command of the user's process, if there is a new one. */
void fri_take_command(struct fri_loop *l) {
    word count = __atomic_load_n(&l->header[H_COMMANDS], __ATOMIC_ACQUIRE);
    if (count == l->commands_seen || count == 0) return;
    word copy[COMMAND_WORDS], *slot = l->seam->commands + (count - 1) % COMMAND_SLOTS * COMMAND_WORDS;
    if (__atomic_load_n(slot, __ATOMIC_ACQUIRE) != 2 * (count - 1) + 2) return; /* being written: read it in the next cycle */
    memcpy(copy, slot, sizeof copy);
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    if (__atomic_load_n(slot, __ATOMIC_RELAXED) != 2 * (count - 1) + 2) return;
    l->commands_seen = count;
    if (copy[C_AT] + GRACE < l->started) return;
    if (copy[C_EPOCH] != l->epoch) {
        l->header[H_STALE]++;
        if (!l->is_stale)
            fri_report(l, KIND_CLIENT, l->session.received,
                       "commands of a program that has not seen this session are not executed: the arm is held until the program "
                       "has read a state of it");
        l->is_stale = 1;
        return;
    }
    double numbers[COMMAND_WORDS];
    memcpy(numbers, copy, sizeof numbers);
    take(&l->commands, numbers, copy[C_AT], copy[C_GIVEN], patience_of(l));
}

/* Age of the last command [s]; whether it has expired, and whether the arm has to brake. */
static double age_of(struct fri_loop *l) {
    struct commands *c = &l->commands;
    c->is_filled = c->is_braking = 0;
    if (!c->at) return 0.0;
    double age = (double)(l->session.received - c->at) * 1e-9, late = age - patience_of(l);
    c->is_filled = late > 0.0;
    c->is_braking = l->seam->missing != HOLD && late > (l->seam->missing == EXTRAPOLATE ? l->seam->over : 0.0);
    return age;
}

/* Target position of this cycle; NULL: brake. `ipo` is the target until a position is commanded. */
const double *fri_position_target(struct fri_loop *l, const double *ipo, double *buffer) {
    struct commands *c = &l->commands;
    double age = age_of(l);
    if (c->is_braking) return NULL;
    if (!c->has_q) return ipo;
    if (l->seam->missing != EXTRAPOLATE || !c->has_slope) return c->q;
    for (int i = 0; i < AXES; i++) buffer[i] = c->q[i] + c->slope[i] * age;
    return buffer;
}

/* Target pose of this cycle; NULL: brake. */
const double *fri_pose_target(struct fri_loop *l, const double *ipo, double *buffer) {
    struct commands *c = &l->commands;
    double age = age_of(l), displacement[6];
    if (c->is_braking) return NULL;
    if (!c->has_pose) return ipo;
    if (l->seam->missing != EXTRAPOLATE || !c->has_twist) return c->pose;
    for (int i = 0; i < 6; i++) displacement[i] = c->twist[i] * age;
    pose_moved(c->pose, displacement, buffer);
    return buffer;
}

/* Target torques and wrench of this cycle: the last ones, or what is left of them after they have expired. */
void fri_efforts(struct fri_loop *l, double *tau, double *wrench) {
    struct commands *c = &l->commands;
    double fraction = 1.0;
    if (c->at && l->seam->missing != HOLD) {
        double late = (double)(l->session.received - c->at) * 1e-9 - patience_of(l);
        if (l->seam->missing == EXTRAPOLATE) late -= l->seam->over;
        if (late > 0.0) fraction = l->seam->over > 0.0 ? most(0.0, 1.0 - late / l->seam->over) : 0.0;
    }
    for (int i = 0; i < AXES; i++) tau[i] = c->has_tau ? fraction * c->tau[i] : 0.0;
    for (int i = 0; i < 6; i++) wrench[i] = c->has_wrench ? fraction * c->wrench[i] : 0.0;
}

/* ------------------------------------------------------------------------------------------------ outputs and frames */

/* The signal of a name in the last message, NULL: none. */
static const struct io_value *signal_of(const struct fri_loop *l, const struct name *name) {
    for (int i = 0; i < l->message->signals; i++)
        if (fri_same_name(&l->message->signal[i].name, name)) return l->message->signal + i;
    return NULL;
}

static struct pending_output *pending_of(struct exchange *e, const struct name *name) {
    for (int i = 0; i < e->pending; i++)
        if (fri_same_name(&e->output[i].name, name)) return e->output + i;
    return NULL;
}

static void drop(struct exchange *e, int index) {
    memmove(e->output + index, e->output + index + 1, (size_t)(--e->pending - index) * sizeof *e->output);
}

/* Repeat an output until the cabinet shows it; an analog one, which the cabinet may round, a few times. */
static void request(struct exchange *e, const struct name *name, int is_analog, word bits) {
    struct pending_output *known = pending_of(e, name);
    if (!known) {
        if (e->pending == MAX_IO) return;
        known = e->output + e->pending++;
    }
    known->name = *name;
    known->is_analog = is_analog;
    known->bits = bits;
    known->left = is_analog ? REPEATS_ANALOG : REPEATS;
}

static word *put_name(word *at, const struct name *name) {
    memset(at, 0, 8 * NAME_WORDS);
    at[0] = name->size;
    memcpy(at + 1, name->bytes, (size_t)name->size);
    return at + NAME_WORDS;
}

static int get_name(const word *at, struct name *name) {
    if (at[0] < 0 || at[0] > NAME_BYTES) return 0;
    name->size = (int)at[0];
    memcpy(name->bytes, at + 1, (size_t)name->size);
    return 1;
}

static word hash(word h, const void *bytes, int size) {
    uint64_t value = (uint64_t)h;
    for (const uint8_t *at = bytes; size-- > 0; at++) value = (value ^ *at) * 1099511628211u;
    return (word)value;
}

/* Publish the names of signals and frames for the user's process when they change. */
void fri_exchange_update(struct fri_loop *l) {
    struct exchange *e = &l->exchange;
    const struct message *m = l->message;
    word now = m->signals * 64 + m->requests + 1;
    for (int i = 0; i < m->signals; i++) {
        int kind[2] = {m->signal[i].type, m->signal[i].direction};
        now = hash(hash(now, kind, sizeof kind), m->signal[i].name.bytes, m->signal[i].name.size);
    }
    for (int i = 0; i < m->requests; i++) now = hash(hash(now, "/", 1), m->request[i].name.bytes, m->request[i].name.size);
    if (now == e->offered) return;
    e->offered = now;
    for (int i = e->pending - 1; i >= 0; i--)
        if (!signal_of(l, &e->output[i].name)) drop(e, i);
    word *note = l->seam->offered, *at = note + 3;
    __atomic_store_n(note, note[0] | 1, __ATOMIC_RELAXED);
    __atomic_thread_fence(__ATOMIC_RELEASE);
    note[1] = m->signals;
    note[2] = m->requests;
    for (int i = 0; i < m->signals; i++) {
        *at++ = m->signal[i].type;
        *at++ = m->signal[i].direction;
        at = put_name(at, &m->signal[i].name);
    }
    for (int i = 0; i < m->requests; i++) at = put_name(at, &m->request[i].name);
    __atomic_store_n(note, note[0] + 1, __ATOMIC_RELEASE);
}

/* Read new outputs and frames of the user's process. */
void fri_exchange_take(struct fri_loop *l) {
    struct exchange *e = &l->exchange;
    const word *note = l->seam->outputs;
    word tick = __atomic_load_n(note, __ATOMIC_ACQUIRE), copy[NOTE_WORDS];
    if (tick == e->outputs_seen || tick & 1) return; /* being written: read it in the next cycle */
    memcpy(copy, note, sizeof copy);
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    if (__atomic_load_n(note, __ATOMIC_RELAXED) != tick) return;
    e->outputs_seen = tick;
    const word *at = copy + 3;
    word newest = e->taken;
    struct name name;
    for (word i = 0; i < copy[1] && i < MAX_IO; i++, at += 3 + NAME_WORDS) {
        if (at[0] <= e->taken || !get_name(at + 3, &name)) continue;
        newest = at[0] > newest ? at[0] : newest;
        request(e, &name, (int)at[1], at[2]);
    }
    e->taken = newest;
    struct time_stamp none = {0, 0, 0}, stamp = l->message->requests ? l->message->request[0].stamp : none;
    for (word i = 0; i < copy[2] && i < MAX_TRANSFORMATIONS; i++, at += NAME_WORDS + 7) {
        struct given_frame *frame = e->frame;
        if (!get_name(at, &name)) continue;
        while (frame < e->frame + e->frames && !fri_same_name(&frame->name, &name)) frame++;
        if (frame == e->frame + e->frames) {
            if (e->frames == MAX_TRANSFORMATIONS) frame = e->frame; /* of a session that has ended */
            else e->frames++;
        } else if (!memcmp(frame->pose, at + NAME_WORDS, sizeof frame->pose)) {
            continue;
        }
        frame->name = name;
        memcpy(frame->pose, at + NAME_WORDS, sizeof frame->pose);
        frame->stamp = stamp;
    }
}

/* Request the outputs that a law in Python has written and the cabinet does not show yet. */
void fri_exchange_write(struct fri_loop *l) {
    struct fri_seam *seam = l->seam;
    for (word i = 0; i < seam->written; i++) {
        if (seam->written_signal[i] < 0 || seam->written_signal[i] >= l->message->signals) continue;
        const struct io_value *signal = l->message->signal + seam->written_signal[i];
        const struct pending_output *pending = pending_of(&l->exchange, &signal->name);
        word bits = seam->written_value[i];
        if ((!pending || pending->bits != bits) && signal->bits != bits) request(&l->exchange, &signal->name, signal->type == ANALOG, bits);
    }
    seam->written = 0;
}

static void number_text(const struct io_value *signal, word bits, char *into, size_t size) {
    double number;
    memcpy(&number, &bits, 8);
    if (signal->type == ANALOG)
        snprintf(into, size, "%g", number);
    else
        snprintf(into, size, "%llu", (unsigned long long)bits);
}

/* Report an output that the cabinet does not accept. */
static void report_refused(struct fri_loop *l, int index, const struct io_value *signal) {
    char value[32], shown[32];
    const struct pending_output *one = l->exchange.output + index;
    number_text(signal, one->bits, value, sizeof value);
    number_text(signal, signal->bits, shown, sizeof shown);
    fri_report(l, KIND_CLIENT, l->session.received, "the cabinet does not accept %.*s = %s: it shows %s", one->name.size,
               (const char *)one->name.bytes, value, shown);
}

/* x y z [m], quaternion x y z w as this version has it: seven numbers, or 3 x 4 row by row; lengths in mm. */
static int frame_numbers(const double *pose, int version, double *into) {
    double x = pose[3], y = pose[4], z = pose[5], w = pose[6], xyz[3] = {1e3 * pose[0], 1e3 * pose[1], 1e3 * pose[2]};
    if (fri_has_quaternions(version)) {
        memcpy(into, xyz, sizeof xyz);
        into[3] = w, into[4] = x, into[5] = y, into[6] = z;
        return 7;
    }
    double rows[12] = {1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), xyz[0],
                       2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), xyz[1],
                       2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), xyz[2]};
    memcpy(into, rows, sizeof rows);
    return 12;
}

/* Encode frames that are requested and given, and outputs that the cabinet does not show yet; how many bytes. */
int fri_exchange_put(struct fri_loop *l, uint8_t *into) {
    struct exchange *e = &l->exchange;
    double numbers[NUMBERS_OF_A_FRAME];
    int size = 0;
    for (int i = 0; i < e->frames; i++)
        for (int k = 0; k < l->message->requests; k++) {
            if (!fri_same_name(&e->frame[i].name, &l->message->request[k].name)) continue;
            int count = frame_numbers(e->frame[i].pose, l->session.version, numbers);
            size += fri_put_frame(&e->frame[i].name, numbers, count, &e->frame[i].stamp, into + size);
            break;
        }
    for (int i = 0; i < e->pending;) {
        struct pending_output *output = e->output + i;
        const struct io_value *signal = signal_of(l, &output->name);
        if (!signal || signal->direction != OUTPUT || (signal->type == ANALOG) != output->is_analog) {
            fri_report(l, KIND_CLIENT, l->session.received, "this FRI session no longer has an output '%.*s'", output->name.size,
                       (const char *)output->name.bytes);
            drop(e, i);
            continue;
        }
        double shown, wanted;
        memcpy(&shown, &signal->bits, 8);
        memcpy(&wanted, &output->bits, 8);
        /* its first answer is sent in any case */
        int is_shown = output->left < REPEATS && (output->is_analog ? shown == wanted : signal->bits == output->bits);
        if (is_shown || !output->left) {
            if (!is_shown && !output->is_analog) report_refused(l, i, signal);
            drop(e, i);
            continue;
        }
        output->left--;
        size += fri_put_output(signal, output->bits, into + size);
        i++;
    }
    return size;
}
