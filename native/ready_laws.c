/* The ready laws; heptarm.laws.ready has their parameters and memories, in the order of the structures here. */
#include <heptarm_filter.h>
#include <heptarm_law.h>

#include "limited_steps.h"
#include "dynamics.h"

static double clamp(double value, double limit) { return value > limit ? limit : value < -limit ? -limit : value; }

/* Shorten a vector to a length; 1 if it was longer. */
static int shorten(double *v, int size, double longest) {
    double length = sqrt(dot(v, v, size));
    if (!(length > longest)) return 0;
    for (int i = 0; i < size; i++) v[i] *= longest / length;
    return 1;
}

/* Limit torques; the number of axes at their limit. */
static int limit_torques(double *tau, const double *limit) {
    int count = 0;
    for (int i = 0; i < N; i++) {
        double kept = clamp(tau[i], limit[i]);
        count += kept != tau[i];
        tau[i] = kept;
    }
    return count;
}

/* First-order low pass of the velocities, which are differences of positions. */
static void smooth(const struct heptarm_state *s, double constant, double *dq, int fresh) {
    double fraction = fresh ? 1.0 : s->dt / (constant + s->dt);
    for (int i = 0; i < N; i++) dq[i] += fraction * (s->dq[i] - dq[i]);
}

static double sane(double goal, double otherwise) { return isfinite(goal) ? goal : otherwise; }

/* ------------------------------------------------------------------------------------------- Cartesian impedance */

struct cartesian {
    struct robot robot;
    double frame[7], goal[7], stiffness[6], damping, force_max, moment_max, speed, turn_speed;
    double posture[N], posture_stiffness, tau_max[N], filter;
};

struct cartesian_memory {
    double goal[7], error[6], force[6], dq[N], posture[N], started, saturated;
};

/* Move a followed pose towards a goal, by at most `far` [m] and `angle_max` [rad]. */
static void follow_pose(const double *goal, double far, double angle_max, double *pose) {
    double wanted[7], step[6], frame[9];
    for (int k = 0; k < 7; k++) wanted[k] = sane(goal[k], pose[k]);
    double norm = sqrt(dot(wanted + 3, wanted + 3, 4));
    for (int k = 3; k < 7; k++) wanted[k] = norm > 1e-6 ? wanted[k] / norm : pose[k];
    for (int k = 0; k < 3; k++) step[k] = wanted[k] - pose[k];
    double x = pose[3], y = pose[4], z = pose[5], w = pose[6];
    double own[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z), 1 - 2 * (x * x + z * z),
                     2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)};
    memcpy(frame, own, sizeof frame);
    rotation_error(frame, wanted + 3, step + 3);
    shorten(step, 3, far);
    for (int k = 0; k < 3; k++) pose[k] += step[k];
    if (!shorten(step + 3, 3, angle_max)) {
        memcpy(pose + 3, wanted + 3, 4 * sizeof(double));
        return;
    }
    double angle = sqrt(dot(step + 3, step + 3, 3)), f = sin(0.5 * angle) / angle, c = cos(0.5 * angle);
    double u = f * step[3], v = f * step[4], t = f * step[5];
    double turned_goal[4] = {c * x + u * w + v * z - t * y, c * y - u * z + v * w + t * x, c * z + u * y - v * x + t * w,
                             c * w - u * x - v * y - t * z};
    double size = sqrt(dot(turned_goal, turned_goal, 4));
    for (int k = 0; k < 4; k++) pose[3 + k] = turned_goal[k] / size;
}

/* From here on a frame that is fixed to the flange counts as it. */
static void move_flange(struct posture *posture, const double *frame) {
    double lever[3], own[9], turn[9];
    rotate(posture->turn, frame, lever);
    rotation(frame + 3, own);
    for (int i = 0; i < 3; i++) {
        posture->place[i] += lever[i];
        for (int j = 0; j < 3; j++) {
            turn[3 * i + j] = 0.0;
            for (int k = 0; k < 3; k++) turn[3 * i + j] += posture->turn[3 * i + k] * own[3 * k + j];
        }
    }
    memcpy(posture->turn, turn, sizeof turn);
}

/* Impedance at a frame of the flange with a compliant posture in its null space (Khatib 1987; Ott, "Cartesian Impedance Control of
   Redundant and Flexible-Joint Robots", 2008). The cabinet compensates gravity and Coriolis torques. */
static int cartesian(const struct heptarm_state *s, struct heptarm_command *out, const struct cartesian *p, struct cartesian_memory *m) {
    struct posture posture;
    double j[6][N], mass[N][N], factor[N * N], inverse[6][N], lambda[36], inertia[6], tau0[N], tau[N], velocity[6];
    find_posture(&p->robot, s->q, &posture);
    move_flange(&posture, p->frame);
    int fresh = m->started == 0.0;
    smooth(s, p->filter, m->dq, fresh);
    if (fresh) {
        memcpy(m->goal, posture.place, sizeof posture.place);
        quaternion(posture.turn, m->goal + 3);
        memcpy(m->posture, s->q, sizeof m->posture);
        m->started = 1.0;
    }
    follow_pose(p->goal, p->speed * s->dt, p->turn_speed * s->dt, m->goal);
    jacobian(posture.axis, posture.origin, posture.place, j);
    moved_mass(&p->robot, &posture, mass);
    memcpy(factor, mass, sizeof factor);
    if (!factorise(factor, N)) return 1;
    for (int r = 0; r < 6; r++) {
        memcpy(inverse[r], j[r], sizeof inverse[r]);
        solve(factor, N, inverse[r]); /* rows of J M^-1 */
    }
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++) lambda[6 * r + c] = dot(j[r], inverse[c], N) + (r == c ? 1e-4 : 0.0);
    if (!factorise(lambda, 6)) return 2;
    for (int r = 0; r < 6; r++) {
        double unit[6] = {0};
        unit[r] = 1.0;
        solve(lambda, 6, unit);
        inertia[r] = unit[r];
        velocity[r] = dot(j[r], m->dq, N);
    }
    for (int k = 0; k < 3; k++) m->error[k] = m->goal[k] - posture.place[k];
    rotation_error(posture.turn, m->goal + 3, m->error + 3);
    for (int r = 0; r < 6; r++) m->force[r] = p->stiffness[r] * m->error[r];
    int limited = shorten(m->force, 3, p->force_max) | shorten(m->force + 3, 3, p->moment_max);
    for (int r = 0; r < 6; r++) m->force[r] -= 2.0 * p->damping * sqrt(fmax(0.0, p->stiffness[r]) * inertia[r]) * velocity[r];
    /* null space: tau0 less what would accelerate the flange */
    for (int i = 0; i < N; i++) {
        double k = p->posture_stiffness, error = sane(p->posture[i], m->posture[i]) - s->q[i];
        tau0[i] = clamp(k * error, 0.3 * k) - 2.0 * p->damping * sqrt(k * mass[i][i]) * m->dq[i];
    }
    double reaction[6];
    for (int r = 0; r < 6; r++) reaction[r] = dot(inverse[r], tau0, N);
    solve(lambda, 6, reaction);
    for (int i = 0; i < N; i++) {
        tau[i] = tau0[i];
        for (int r = 0; r < 6; r++) tau[i] += j[r][i] * (m->force[r] - reaction[r]);
    }
    limited += limit_torques(tau, p->tau_max);
    m->saturated += limited != 0;
    memcpy(out->tau, tau, sizeof tau);
    return 0;
}
HEPTARM_LAW(cartesian_impedance, cartesian, struct cartesian, struct cartesian_memory)

/* ----------------------------------------------------------------------------------------------- joint impedance */

struct joints {
    struct robot robot;
    double goal[N], stiffness[N], damping, smoothing, speed[N], tau_max[N], filter;
};

struct joints_memory {
    double q[N], dq_goal[N], dq[N], feed_forward[N], started, saturated;
};

/* Joint impedance around a reference that follows the goal like a critically damped system of second order, with the
   torque of the reference's acceleration. */
static int joints(const struct heptarm_state *s, struct heptarm_command *out, const struct joints *p, struct joints_memory *m) {
    struct posture posture;
    double mass[N][N], ddq[N], tau[N], rate = 1.0 / fmax(p->smoothing, 2.0 * s->dt);
    int fresh = m->started == 0.0;
    smooth(s, p->filter, m->dq, fresh);
    if (fresh) memcpy(m->q, s->q, sizeof m->q);
    m->started = 1.0;
    for (int i = 0; i < N; i++) {
        double goal = sane(p->goal[i], m->q[i]), before = m->dq_goal[i];
        /* semi-implicit: stable for every step; the error is limited so that the speed stays below its limit */
        double pull = clamp(rate * (goal - m->q[i]), 2.0 * p->speed[i]);
        m->dq_goal[i] = clamp((before + s->dt * rate * pull) / (1.0 + 2.0 * rate * s->dt), p->speed[i]);
        ddq[i] = (m->dq_goal[i] - before) / s->dt;
        m->q[i] += s->dt * m->dq_goal[i];
    }
    find_posture(&p->robot, s->q, &posture);
    moved_mass(&p->robot, &posture, mass);
    for (int i = 0; i < N; i++) {
        m->feed_forward[i] = dot(mass[i], ddq, N);
        double damping = 2.0 * p->damping * sqrt(fmax(0.0, p->stiffness[i]) * mass[i][i]);
        tau[i] = p->stiffness[i] * (m->q[i] - s->q[i]) + damping * (m->dq_goal[i] - m->dq[i]) + m->feed_forward[i];
    }
    m->saturated += limit_torques(tau, p->tau_max) != 0;
    memcpy(out->tau, tau, sizeof tau);
    return 0;
}
HEPTARM_LAW(joint_impedance, joints, struct joints, struct joints_memory)

/* ------------------------------------------------------------------------------------------------- free guiding */

struct guiding {
    struct robot robot;
    double damping[N], low[3], high[3], wall_stiffness, wall_damping, force_max;
    double q_low[N], q_high[N], margin, joint_stiffness, extra_mass, extra_com[3], gravity[3], tau_max[N], filter;
};

struct guiding_memory {
    double force[3], dq[N], started, saturated;
};

/* Force of a one-sided wall: a spring, and a damper that never pulls. */
static double wall(double depth, double closing, double stiffness, double damping) {
    return depth > 0.0 ? fmax(0.0, stiffness * depth + damping * closing) : 0.0;
}

static int guiding(const struct heptarm_state *s, struct heptarm_command *out, const struct guiding *p, struct guiding_memory *m) {
    struct posture posture;
    double j[6][N], extra[6][N], tau[N], point[3];
    smooth(s, p->filter, m->dq, m->started == 0.0);
    m->started = 1.0;
    find_posture(&p->robot, s->q, &posture);
    jacobian(posture.axis, posture.origin, posture.place, j);
    for (int k = 0; k < 3; k++) {
        double x = posture.place[k], v = dot(j[k], m->dq, N);
        m->force[k] = wall(p->low[k] - x, -v, p->wall_stiffness, p->wall_damping) - wall(x - p->high[k], v, p->wall_stiffness, p->wall_damping);
    }
    int limited = shorten(m->force, 3, p->force_max);
    rotate(posture.turn, p->extra_com, point);
    for (int k = 0; k < 3; k++) point[k] += posture.place[k];
    jacobian(posture.axis, posture.origin, point, extra);
    for (int i = 0; i < N; i++) {
        tau[i] = -p->damping[i] * m->dq[i];
        tau[i] += wall(p->q_low[i] + p->margin - s->q[i], -m->dq[i], p->joint_stiffness, 0.1 * p->joint_stiffness);
        tau[i] -= wall(s->q[i] - p->q_high[i] + p->margin, m->dq[i], p->joint_stiffness, 0.1 * p->joint_stiffness);
        for (int k = 0; k < 3; k++) tau[i] += j[k][i] * m->force[k] - p->extra_mass * extra[k][i] * p->gravity[k];
    }
    m->saturated += (limited + limit_torques(tau, p->tau_max)) != 0;
    memcpy(out->tau, tau, sizeof tau);
    return 0;
}
HEPTARM_LAW(free_guiding, guiding, struct guiding, struct guiding_memory)

/* ----------------------------------------------------------------------------------------------- reflected force */

struct reflection {
    struct robot robot;
    double wrench[6], force_max, moment_max, damping[N], tank, is_passive, tau_max[N], filter;
};

struct reflection_memory {
    double wrench[6], energy, fraction, dq[N], q[N], tau[N], started, saturated;
};

/* A leader feels the wrench of its follower, which comes late; the torques give back no more energy than was put in. What they
   took is known exactly, since a torque is constant for a cycle: the torque times the joints' movement (Ryu, Preusche, Hannaford
   and Hirzinger, "Time domain passivity control with reference energy following", 2005). The wrench is reduced to what the tank
   has left, and damping repays what a prediction missed. */
static int reflection(const struct heptarm_state *s, struct heptarm_command *out, const struct reflection *p, struct reflection_memory *m) {
    struct posture posture;
    double j[6][N], mass[N][N], factor[N * N], felt[N], change[N], tau[N], work = 0.0, square = 0.0;
    int fresh = m->started == 0.0;
    find_posture(&p->robot, s->q, &posture);
    smooth(s, p->filter, m->dq, fresh);
    for (int i = 0; i < N && !fresh; i++) m->energy -= m->tau[i] * (s->q[i] - m->q[i]);
    m->energy = fmin(m->energy, p->tank);
    memcpy(m->q, s->q, sizeof m->q);
    m->started = 1.0;
    memcpy(m->wrench, p->wrench, sizeof m->wrench);
    int limited = shorten(m->wrench, 3, p->force_max) | shorten(m->wrench + 3, 3, p->moment_max);
    jacobian(posture.axis, posture.origin, posture.place, j);
    moved_mass(&p->robot, &posture, mass);
    memcpy(factor, mass, sizeof factor);
    if (!factorise(factor, N)) return 1;
    for (int i = 0; i < N; i++) {
        felt[i] = 0.0;
        for (int r = 0; r < 6; r++) felt[i] += j[r][i] * m->wrench[r];
    }
    memcpy(change, felt, sizeof change);
    solve(factor, N, change);
    for (int i = 0; i < N; i++) { /* of the next cycle, in which the torques also accelerate the joints */
        work += s->dt * felt[i] * (s->dq[i] + s->dt * change[i]);
        square += s->dq[i] * s->dq[i];
    }
    m->fraction = p->is_passive == 0.0 || work <= 0.0 ? 1.0 : fmin(1.0, fmax(0.0, m->energy) / work);
    double repaid = p->is_passive != 0.0 && m->energy < 0.0 && square > 0.0 ? -m->energy / (s->dt * square) : 0.0;
    for (int i = 0; i < N; i++)
        tau[i] = m->fraction * felt[i] - p->damping[i] * m->dq[i] - fmin(repaid, 0.25 * mass[i][i] / s->dt) * s->dq[i];
    limited += limit_torques(tau, p->tau_max);
    m->saturated += limited != 0;
    memcpy(m->tau, tau, sizeof tau);
    memcpy(out->tau, tau, sizeof tau);
    return 0;
}
HEPTARM_LAW(reflected_force, reflection, struct reflection, struct reflection_memory)

/* ---------------------------------------------------------------------------------------------------- admittance */

struct admittance {
    struct robot robot;
    double wrench[6], mass[6], damping[6], stiffness[6], dead_band, moment_dead_band, speed, turn_speed;
};

struct admittance_memory {
    double q[N], offset[6], velocity[6], wrench[6], started, saturated;
};

/* Shrink a vector by a dead band. */
static void shrink(double *v, double band) {
    double length = sqrt(dot(v, v, 3)), scale = length > band ? 1.0 - band / length : 0.0;
    for (int k = 0; k < 3; k++) v[k] *= scale;
}

/* The flange moves like a mass with damper and spring under the external wrench, plus a commanded one. */
static int admittance(const struct heptarm_state *s, struct heptarm_command *out, const struct admittance *p, struct admittance_memory *m) {
    struct posture posture;
    double j[6][N], square[36], twist[6];
    if (m->started == 0.0) memcpy(m->q, s->q_ipo, sizeof m->q);
    m->started = 1.0;
    find_posture(&p->robot, m->q, &posture);
    jacobian(posture.axis, posture.origin, posture.place, j);
    if (!damped_square(j, square)) return 1;
    for (int r = 0; r < 6; r++) m->wrench[r] = dot(j[r], s->tau_ext, N);
    solve(square, 6, m->wrench);
    shrink(m->wrench, p->dead_band);
    shrink(m->wrench + 3, p->moment_dead_band);
    for (int r = 0; r < 6; r++) {
        double force = m->wrench[r] + p->wrench[r] - p->stiffness[r] * m->offset[r];
        m->velocity[r] = (m->velocity[r] + s->dt * force / p->mass[r]) / (1.0 + s->dt * p->damping[r] / p->mass[r]);
    }
    m->saturated += (shorten(m->velocity, 3, p->speed) | shorten(m->velocity + 3, 3, p->turn_speed)) != 0;
    for (int r = 0; r < 6; r++) {
        m->offset[r] += s->dt * m->velocity[r];
        twist[r] = m->velocity[r];
    }
    solve(square, 6, twist);
    for (int i = 0; i < N; i++) {
        for (int r = 0; r < 6; r++) m->q[i] += s->dt * j[r][i] * twist[r];
        out->q[i] = m->q[i];
    }
    return 0;
}
HEPTARM_LAW(admittance_of_the_flange, admittance, struct admittance, struct admittance_memory)

/* ---------------------------------------------------------------------------------------- hybrid force and position */

struct hybrid {
    struct robot robot;
    double goal[7], turn[9], force_axes[6], wrench[6], mass[6], damping[6], speed, turn_speed;
};

struct hybrid_memory {
    double goal[7], q[N], wrench[6], error[6], velocity[6], started, saturated;
};

/* Both halves of a twist or a wrench from base axes to those of a frame, or back. */
static void turn_halves(const double *turn, int back, const double *from, double *into) {
    for (int half = 0; half < 6; half += 3)
        for (int k = 0; k < 3; k++) {
            into[half + k] = 0.0;
            for (int i = 0; i < 3; i++) into[half + k] += (back ? turn[3 * k + i] : turn[3 * i + k]) * from[half + i];
        }
}

/* Along some axes of a frame the flange exerts a wrench, along the others it follows a goal (Raibert and Craig, "Hybrid
   Position/Force Control of Manipulators", 1981), with velocities: a mass on a damper under the error of the force, and half
   of the error of the position in each step. */
static int hybrid(const struct heptarm_state *s, struct heptarm_command *out, const struct hybrid *p, struct hybrid_memory *m) {
    struct posture posture;
    double j[6][N], square[36], found[6], error[6], velocity[6], twist[6];
    int fresh = m->started == 0.0;
    if (fresh) memcpy(m->q, s->q_ipo, sizeof m->q);
    m->started = 1.0;
    find_posture(&p->robot, m->q, &posture);
    if (fresh) {
        memcpy(m->goal, posture.place, sizeof posture.place);
        quaternion(posture.turn, m->goal + 3);
    }
    follow_pose(p->goal, p->speed * s->dt, p->turn_speed * s->dt, m->goal);
    jacobian(posture.axis, posture.origin, posture.place, j);
    if (!damped_square(j, square)) return 1;
    for (int r = 0; r < 6; r++) found[r] = dot(j[r], s->tau_ext, N);
    solve(square, 6, found);
    for (int k = 0; k < 3; k++) error[k] = m->goal[k] - posture.place[k];
    rotation_error(posture.turn, m->goal + 3, error + 3);
    turn_halves(p->turn, 0, found, m->wrench);
    turn_halves(p->turn, 0, error, m->error);
    for (int r = 0; r < 6; r++) {
        double free = (m->velocity[r] + s->dt * (p->wrench[r] + m->wrench[r]) / p->mass[r]) / (1.0 + s->dt * p->damping[r] / p->mass[r]);
        m->velocity[r] = p->force_axes[r] != 0.0 ? clamp(free, r < 3 ? p->speed : p->turn_speed) : 0.0;
        velocity[r] = p->force_axes[r] != 0.0 ? m->velocity[r] : 0.5 * m->error[r] / s->dt;
    }
    m->saturated += (shorten(velocity, 3, 2.0 * p->speed) | shorten(velocity + 3, 3, 2.0 * p->turn_speed)) != 0;
    turn_halves(p->turn, 1, velocity, twist);
    solve(square, 6, twist);
    for (int i = 0; i < N; i++) {
        for (int r = 0; r < 6; r++) m->q[i] += s->dt * j[r][i] * twist[r];
        out->q[i] = m->q[i];
    }
    return 0;
}
HEPTARM_LAW(hybrid_of_the_flange, hybrid, struct hybrid, struct hybrid_memory)

/* -------------------------------------------------------------------------------------------------- minimum jerk */

struct minimum_jerk {
    double goal[N], speed[N], acceleration[N];
};

struct minimum_jerk_memory {
    double q[N], dq[N], ddq[N], goal[N], left, started;
};

/* Quintic to the goal at rest (Flash and Hogan 1985), planned again from position, velocity and acceleration whenever the
   goal changes; all joints arrive together. Peaks of a quintic from rest: 15/8 d/T and 10/sqrt(3) d/T^2. */
static int minimum_jerk(const struct heptarm_state *s, struct heptarm_command *out, const struct minimum_jerk *p, struct minimum_jerk_memory *m) {
    if (m->started == 0.0) {
        memcpy(m->q, s->q_ipo, sizeof m->q);
        memcpy(m->goal, s->q_ipo, sizeof m->goal);
        m->started = 1.0;
    }
    int is_new = 0;
    for (int i = 0; i < N; i++) {
        double goal = sane(p->goal[i], m->goal[i]);
        is_new |= goal != m->goal[i];
        m->goal[i] = goal;
    }
    if (is_new) {
        m->left = 0.0;
        for (int i = 0; i < N; i++) {
            double far = fabs(m->goal[i] - m->q[i]), moving = fabs(m->dq[i]);
            m->left = fmax(m->left, 1.875 * far / p->speed[i]);
            m->left = fmax(m->left, sqrt(5.7735 * far / p->acceleration[i]));
            m->left = fmax(m->left, 4.0 * moving / p->acceleration[i]); /* time to turn round */
        }
    }
    double t = fmin(s->dt, m->left), T = m->left;
    for (int i = 0; i < N && T > 0.0; i++) {
        /* the quintic from (q, dq, ddq) to rest at the goal in T, after t */
        double d = m->goal[i] - m->q[i], v = m->dq[i], a = m->ddq[i];
        double c3 = (20 * d - 12 * v * T - 3 * a * T * T) / (2 * T * T * T);
        double c4 = (-30 * d + 16 * v * T + 3 * a * T * T) / (2 * T * T * T * T);
        double c5 = (12 * d - 6 * v * T - a * T * T) / (2 * T * T * T * T * T);
        m->q[i] += t * (v + t * (a / 2 + t * (c3 + t * (c4 + t * c5))));
        m->dq[i] = v + t * (a + t * (3 * c3 + t * (4 * c4 + t * 5 * c5)));
        m->ddq[i] = a + t * (6 * c3 + t * (12 * c4 + t * 20 * c5));
    }
    m->left -= t;
    if (m->left < 0.5 * s->dt) {
        memcpy(m->q, m->goal, sizeof m->q);
        memset(m->dq, 0, sizeof m->dq);
        memset(m->ddq, 0, sizeof m->ddq);
        m->left = 0.0;
    }
    memcpy(out->q, m->q, sizeof m->q);
    return 0;
}
HEPTARM_LAW(minimum_jerk_targets, minimum_jerk, struct minimum_jerk, struct minimum_jerk_memory)

/* ------------------------------------------------------------------------------------------ jerk-limited targets */

struct jerk_limited {
    double goal[N], speed[N], acceleration[N], jerk[N];
};

struct jerk_limited_memory {
    double q[N], dq[N], ddq[N], is_there, started;
};

/* Each joint on its own to a goal that may change at any time, as fast as its limits allow; the next step is chosen such that
   the joint can still come to rest at the goal, as in the guard of positions. */
static int jerk_limited(const struct heptarm_state *s, struct heptarm_command *out, const struct jerk_limited *p, struct jerk_limited_memory *m) {
    double dt = s->dt;
    if (m->started == 0.0) memcpy(m->q, s->q_ipo, sizeof m->q);
    m->started = m->is_there = 1.0;
    for (int i = 0; i < N; i++) {
        double step = sane(p->goal[i], m->q[i]) - m->q[i], v = m->dq[i] * dt, before = m->ddq[i] * dt * dt;
        double jerk = p->jerk[i] * dt * dt * dt;
        if (!(jerk > 0.0)) return 1; /* without jerk no joint comes to rest */
        double top = most(p->acceleration[i] * dt * dt, fabs(before) - jerk);
        int is_there;
        double a = acceleration_to(step, 0.0, v, before, p->speed[i] * dt, top, jerk, &is_there);
        /* limits that were lowered on the way are reached within the jerk */
        a = least(most(most(a, -top), before - jerk), least(top, before + jerk));
        m->q[i] = is_there ? m->q[i] + step : m->q[i] + v + a;
        m->dq[i] = (v + a) / dt;
        m->ddq[i] = a / (dt * dt);
        if (!is_there) m->is_there = 0.0;
    }
    memcpy(out->q, m->q, sizeof m->q);
    return 0;
}
HEPTARM_LAW(jerk_limited_targets, jerk_limited, struct jerk_limited, struct jerk_limited_memory)

/* ------------------------------------------------------------------------------------------------------- filters */

struct low_pass {
    double goal[N], frequency, damping, order;
};

struct low_pass_memory {
    double q[N], dq[N], started;
};

static int low_pass(const struct heptarm_state *s, struct heptarm_command *out, const struct low_pass *p, struct low_pass_memory *m) {
    if (m->started == 0.0) memcpy(m->q, s->q_ipo, sizeof m->q);
    m->started = 1.0;
    for (int i = 0; i < N; i++) {
        double goal = sane(p->goal[i], m->q[i]);
        if (p->order < 2.0)
            heptarm_low_pass_1(m->q + i, goal, p->frequency, s->dt);
        else
            heptarm_low_pass_2(m->q + i, m->dq + i, goal, p->frequency, p->damping, s->dt);
        out->q[i] = m->q[i];
    }
    return 0;
}
HEPTARM_LAW(low_pass_of_targets, low_pass, struct low_pass, struct low_pass_memory)

struct readings {
    double frequency, damping, order;
};

enum { READINGS = 3 * N + 6 };
struct readings_memory {
    double dq[N], tau[N], tau_ext[N], wrench[6], rate[READINGS], started;
};

/* Low pass of what the arm measures; the arm follows its motion of the cabinet. A reading that is missing keeps the last value. */
static int readings(const struct heptarm_state *s, struct heptarm_command *out, const struct readings *p, struct readings_memory *m) {
    double *kept = (double *)m, raw[READINGS];
    (void)out;
    memcpy(raw, s->dq, sizeof s->dq);
    memcpy(raw + N, s->tau, sizeof s->tau);
    memcpy(raw + 2 * N, s->tau_ext, sizeof s->tau_ext);
    memcpy(raw + 3 * N, s->wrench, sizeof s->wrench);
    for (int i = 0; i < READINGS; i++) {
        double x = sane(raw[i], kept[i]);
        if (m->started == 0.0)
            kept[i] = x;
        else if (p->order < 2.0)
            heptarm_low_pass_1(kept + i, x, p->frequency, s->dt);
        else
            heptarm_low_pass_2(kept + i, m->rate + i, x, p->frequency, p->damping, s->dt);
    }
    m->started = 1.0;
    return 0;
}
HEPTARM_LAW(low_pass_of_readings, readings, struct readings, struct readings_memory)

/* -------------------------------------------------------------------------------------------------------- search */

struct search {
    double push[3], first[3], second[3], amplitude, frequency, second_frequency, phase, rise, is_spiral;
};

struct search_memory {
    double force[3], turns, done;
};

/* A force that searches in the plane of two directions while another one pushes: a spiral that grows within `rise`, or a
   Lissajous figure that is switched on smoothly. */
static int search(const struct heptarm_state *s, struct heptarm_command *out, const struct search *p, struct search_memory *m) {
    double angle = 2.0 * 3.14159265358979323846, grown = fmin(1.0, s->t / fmax(p->rise, s->dt));
    double eased = p->is_spiral != 0.0 ? grown : grown * grown * (3.0 - 2.0 * grown);
    double a = p->amplitude * eased * (p->is_spiral != 0.0 ? cos(angle * p->frequency * s->t) : sin(angle * p->frequency * s->t));
    double b = p->amplitude * eased *
               (p->is_spiral != 0.0 ? sin(angle * p->frequency * s->t) : sin(angle * p->second_frequency * s->t + p->phase));
    for (int k = 0; k < 3; k++) {
        m->force[k] = fmin(1.0, s->t / 0.5) * p->push[k] + a * p->first[k] + b * p->second[k];
        out->wrench[k] = m->force[k];
    }
    m->turns = p->frequency * s->t;
    m->done = grown >= 1.0;
    return 0;
}
HEPTARM_LAW(search_by_force, search, struct search, struct search_memory)

/* ------------------------------------------------------------------------------- the model alone, for its tests */

/* Dynamics without the motors' inertia, as in heptarm.model. */
void heptarm_model(const struct robot *robot, const double *q, const double *dq, double *mass, double *bias, double *weight, double *j, double *pose) {
    static const double fall[3] = {0.0, 0.0, -9.81};
    struct posture posture;
    find_posture(robot, q, &posture);
    mass_matrix(&posture, (double(*)[N])mass);
    coriolis(&posture, dq, bias);
    gravity(&posture, fall, weight);
    jacobian(posture.axis, posture.origin, posture.place, (double(*)[N])j);
    memcpy(pose, posture.place, sizeof posture.place);
    quaternion(posture.turn, pose + 3);
}
