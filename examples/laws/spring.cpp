// A law for FRI in C++: joints that follow a goal like a spring with damping, by torques.
//
//     c++ -O2 -shared -fPIC -I$(python -c "import heptarm.fri as f; print(f.include_dir())") -o spring.so spring.cpp
//
// and in Python: heptarm.law_from("spring.so", "spring", params={...}, memory={...}).
#include <algorithm>

#include <heptarm_law.h>

// The structures have the names, the shapes and the order of params= and memory=; every member is a double.
struct parameters {
    double goal[7], stiffness, damping, tau, most;
};

struct memory {
    double x[7], started;
};

static int follow(const heptarm_state *s, heptarm_command *out, const parameters *p, memory *m) {
    if (m->started == 0.0) std::copy_n(s->q, 7, m->x);
    m->started = 1.0;
    for (int i = 0; i < 7; i++) {
        m->x[i] += s->dt * (p->goal[i] - m->x[i]) / p->tau;
        const double tau = p->stiffness * (m->x[i] - s->q[i]) - p->damping * s->dq[i];
        out->tau[i] = std::clamp(tau, -p->most, p->most);
    }
    return 0;
}

HEPTARM_LAW(spring, follow, parameters, memory)
