/* Laws of the tests of compiled laws. */
#include <math.h>
#include <stdlib.h>
#include <time.h>

#include <heptarm_law.h>

struct offsets {
    double offset[7];
};

struct filtered {
    double x[7], calls;
};

static int follow(const struct heptarm_state *s, struct heptarm_command *out, const struct offsets *p, struct filtered *m) {
    for (int i = 0; i < 7; i++) {
        m->x[i] += 20.0 * s->dt * (p->offset[i] - m->x[i]);
        out->q[i] = s->q_ipo[i] + m->x[i];
    }
    m->calls += 1.0;
    return 0;
}
HEPTARM_LAW(filtered, follow, struct offsets, struct filtered)

/* what: 0 nothing, 1 NaN, 2 a division by zero, 3 a wild pointer, 4 endless, 5 slow, 6 refuses, 7 a stack that overflows, 8 NaN once */
struct choice {
    double what;
};

struct calls {
    double calls;
};

static volatile int zero, *nowhere;

static int deep(volatile char *before) {
    volatile char more[1 << 14];
    more[0] = before ? before[0] : 1;
    return deep(more) + more[1];
}

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int misbehave(const struct heptarm_state *s, struct heptarm_command *out, const struct choice *p, struct calls *m) {
    m->calls += 1.0;
    switch ((int)p->what) {
    case 1: out->q[2] = NAN; break;
    case 2: out->q[0] = 1000 / zero; break;
    case 3: *nowhere = 1; break;
    case 4:
        for (;;) zero++;
    case 5:
        for (double end = now() + 0.9 * s->dt; now() < end;) {}
        break;
    case 6: return 42;
    case 7: return deep(0);
    case 8: out->q[2] = (int)m->calls % 5 ? out->q[2] : NAN; break;
    }
    return 0;
}
HEPTARM_LAW(misbehaving, misbehave, struct choice, struct calls)

/* Velocities and times as Python sees them. */
struct seen {
    double dq[7], t, dt;
};

static int look(const struct heptarm_state *s, struct heptarm_command *out, const double *p, struct seen *m) {
    (void)p;
    for (int i = 0; i < 7; i++) {
        m->dq[i] = s->dq[i];
        out->q[i] += 0.01 * sin(3.0 * s->t + i) + 0.001 * s->dq[i];
    }
    m->t = s->t;
    m->dt = s->dt;
    return 0;
}
HEPTARM_LAW(looking, look, double, struct seen)
