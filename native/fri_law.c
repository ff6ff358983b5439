/* The call of a compiled law: its parameters and memory, its time limit, and what happens when it crashes.

   A law runs in the thread of the loop, as the loop's own code does. One that crashes or does not return is left by a jump out of
   a signal's handler; the arm then brakes, and its process goes on. On Linux a timer of the thread's processor time ends an
   endless law; elsewhere only a crash is caught. */
#include <setjmp.h>
#include <signal.h>
#include <time.h>
#include <unistd.h>
#ifdef __linux__
#include <sys/syscall.h>
#endif

#include "fri.h"

typedef int (*compiled_law)(const struct heptarm_state *, struct heptarm_command *, const void *, void *);

static sigjmp_buf law_exit;
static volatile sig_atomic_t in_law;
static word law_armed; /* when the timer was set */
static char law_stack[1 << 16]; /* for the handler of a stack overflow */
static const int crashes[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};

#ifdef __linux__
#define TIME_IS_UP (SIGRTMIN + 5)
static timer_t law_timer;
static int has_timer;
#else
#define TIME_IS_UP (-1)
#endif

static word clock_now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1000000000LL + t.tv_nsec;
}

static void on_signal(int number) {
    if (in_law) {
        in_law = 0;
        siglongjmp(law_exit, number);
    }
    if (number == TIME_IS_UP) return; /* the law had just returned */
    signal(number, SIG_DFL);
    raise(number);
}

/* Prepare this thread for running a compiled law. */
void fri_protect(void) {
    struct sigaction action = {.sa_handler = on_signal, .sa_flags = SA_NODEFER | SA_ONSTACK};
    stack_t stack = {.ss_sp = law_stack, .ss_size = sizeof law_stack};
    sigemptyset(&action.sa_mask);
    sigaltstack(&stack, NULL);
    for (unsigned i = 0; i < sizeof crashes / sizeof *crashes; i++) sigaction(crashes[i], &action, NULL);
#ifdef __linux__
#ifndef sigev_notify_thread_id
#define sigev_notify_thread_id _sigev_un._tid
#endif
    struct sigevent event = {.sigev_notify = SIGEV_THREAD_ID, .sigev_signo = TIME_IS_UP};
    sigaction(TIME_IS_UP, &action, NULL);
    event.sigev_notify_thread_id = (pid_t)syscall(SYS_gettid);
    has_timer = !timer_create(CLOCK_THREAD_CPUTIME_ID, &event, &law_timer);
#endif
}

/* Set the timer, not in every call: it takes as long as a short law. */
static void limit_time(word now) {
#ifdef __linux__
    struct itimerspec limit = {.it_value = {.tv_sec = LAW_CUT / 1000000000LL, .tv_nsec = LAW_CUT % 1000000000LL}};
    if (!has_timer || now - law_armed <= LAW_CUT / 4) return;
    timer_settime(law_timer, 0, &limit, NULL);
    law_armed = now;
#else
    (void)now, (void)law_armed;
#endif
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
void fri_follow(double *values, const double *targets, const double *rates, word count, double dt) {
    for (word i = 0; i < count; i++) {
        double step = rates[i] * dt, apart = targets[i] - values[i];
        values[i] = isfinite(apart) && fabs(apart) > step ? values[i] + copysign(step, apart) : targets[i];
    }
}

/* Take over parameters, and what the user's process has written to the memory. */
static void take_parameters(struct fri_loop *l, double dt) {
    struct fri_seam *s = l->seam;
    double *copy = (double *)s->law_buffer;
    word size = s->params_size, many = s->memory_size, before = s->params_seen;
    word count = __atomic_load_n(&l->header[H_PARAMS], __ATOMIC_ACQUIRE);
    if (take_slot(s->params_ring, count, PARAM_SLOTS, size, &s->params_seen, copy)) {
        memcpy(s->params_target, copy, 8 * (size_t)size);
        if (!before) memcpy(s->params, copy, 8 * (size_t)size);
    }
    fri_follow((double *)s->params, (double *)s->params_target, (double *)s->params_rates, size, dt);
    count = __atomic_load_n(&l->header[H_MEMORY_SET], __ATOMIC_ACQUIRE);
    if (!take_slot(s->memory_set_ring, count, MEMORY_SLOTS, 2 * many, &s->memory_seen, copy)) return;
    for (word i = 0; i < many; i++) {
        double *written = (double *)s->memory_written + i;
        if (copy[many + i] <= *written) continue;
        *written = copy[many + i];
        ((double *)s->memory)[i] = copy[i];
    }
}

static void publish_memory(struct fri_loop *l) {
    word tick = l->header[H_MEMORY], *slot = l->seam->memory_ring + tick % MEMORY_SLOTS * (l->seam->memory_size + 1);
    __atomic_store_n(slot, 2 * tick + 1, __ATOMIC_RELAXED);
    __atomic_thread_fence(__ATOMIC_RELEASE);
    memcpy(slot + 1, l->seam->memory, 8 * (size_t)l->seam->memory_size);
    __atomic_store_n(slot, 2 * tick + 2, __ATOMIC_RELEASE);
    __atomic_store_n(&l->header[H_MEMORY], tick + 1, __ATOMIC_RELEASE);
}

static void law_state(const struct fri_loop *l, const word *slot, struct heptarm_state *s) {
    double numbers[STATE_WORDS];
    word multiplier = slot[S_MULTIPLIER] > 0 ? slot[S_MULTIPLIER] : 1;
    memcpy(numbers, slot, sizeof numbers);
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

/* Whether the law has given numbers for everything that this session commands; the guard of poses keeps the last target. */
static int is_finite(const struct fri_loop *l) {
    const struct heptarm_command *out = &l->seam->out;
    word mode = l->session.mode;
    return mode == CARTESIAN_POSE || (all_finite(out->q, AXES) && (mode != TORQUE || all_finite(out->tau, AXES)) &&
                                      (mode != WRENCH || all_finite(out->wrench, 6)));
}

static int failed(struct fri_loop *l, int status, word code) {
    l->seam->law_code = code;
    return (int)(l->seam->law_status = status);
}

/* Call the compiled law on the state in a slot, with its prepared output: LAW_OK, or why it failed. */
int fri_law(struct fri_loop *l, const word *slot) {
    struct fri_seam *s = l->seam;
    struct heptarm_state state;
    law_state(l, slot, &state);
    take_parameters(l, state.dt);
    word budget = (word)(LAW_FRACTION * state.dt * 1e9), began = clock_now();
    int number = sigsetjmp(law_exit, 0);
    if (number) return failed(l, number == TIME_IS_UP ? LAW_ENDLESS : LAW_CRASHED, number);
    limit_time(began);
    in_law = 1;
    int code = ((compiled_law)s->law)(&state, &s->out, s->params, s->memory);
    in_law = 0;
    publish_memory(l);
    if (code != s->law_success) return failed(l, LAW_REFUSED, code);
    s->law_not_finite = is_finite(l) ? 0 : s->law_not_finite + 1;
    if (s->law_not_finite >= LAW_PATIENCE) return failed(l, LAW_NOT_FINITE, s->law_not_finite);
    word took = clock_now() - began;
    s->law_late = took > budget ? s->law_late + 1 : 0;
    l->header[H_OVERRUNS] += took > budget;
    return s->law_late >= LAW_PATIENCE ? failed(l, LAW_SLOW, took) : LAW_OK;
}
