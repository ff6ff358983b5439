/* The law `drift` of laws.py in C. */
#include <heptarm_law.h>

struct parameters {
    double goal[7], tau;
};

struct memory {
    double x[7], calls;
};

static int drift(const struct heptarm_state *s, struct heptarm_command *out, const struct parameters *p, struct memory *m) {
    for (int i = 0; i < 7; i++) {
        m->x[i] += s->dt * (p->goal[i] - m->x[i]) / p->tau;
        out->q[i] = s->q_ipo[i] + m->x[i];
    }
    m->calls += 1.0;
    return 0;
}
HEPTARM_LAW(step, drift, struct parameters, struct memory)
