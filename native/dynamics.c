/* Dynamics of one posture, for heptarm.model. */
#include "dynamics.h"

void hd_mass_matrix(const struct robot *robot, const double *q, double *m) {
    struct posture p;
    find_posture(robot, q, &p);
    mass_matrix(&p, (double(*)[N])m);
}

/* Torques M ddq + C dq + g with the acceleration of gravity `fall`. */
void hd_inverse(const struct robot *robot, const double *q, const double *dq, const double *ddq, const double *fall, double *tau) {
    struct posture p;
    find_posture(robot, q, &p);
    inverse_dynamics(&p, dq, ddq, fall, tau);
}

/* Accelerations M^-1 (tau - C dq - g). Returns 0 if M is not positive definite. */
int hd_forward(const struct robot *robot, const double *q, const double *dq, const double *tau, const double *fall, double *ddq) {
    static const double none[N];
    struct posture p;
    double m[N][N];
    find_posture(robot, q, &p);
    mass_matrix(&p, m);
    inverse_dynamics(&p, dq, none, fall, ddq);
    for (int i = 0; i < N; i++) ddq[i] = tau[i] - ddq[i];
    if (!factorise(&m[0][0], N)) return 0;
    solve(&m[0][0], N, ddq);
    return 1;
}

/* C = sum m Jv' dJv + Jw' (I dJw + [w] I Jw) over the bodies: with it dM/dt - 2 C is skew-symmetric (Siciliano et al., section 7.1). */
void hd_coriolis_matrix(const struct robot *robot, const double *q, const double *dq, double *matrix) {
    struct posture p;
    double spin[N][3] = {{0}}, axis_rate[N][3], origin_rate[N][3] = {{0}}; /* of what carries a joint */
    find_posture(robot, q, &p);
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < 3; k++) {
            spin[i][k] = i ? spin[i - 1][k] + p.axis[i - 1][k] * dq[i - 1] : 0.0;
            origin_rate[i][k] = i ? p.origin[i][k] - p.origin[i - 1][k] : 0.0;
        }
        cross(spin[i], origin_rate[i], origin_rate[i]);
        for (int k = 0; k < 3 && i; k++) origin_rate[i][k] += origin_rate[i - 1][k];
        cross(spin[i], p.axis[i], axis_rate[i]);
    }
    memset(matrix, 0, N * N * sizeof *matrix);
    for (int body = 0; body < BODIES; body++) {
        int last = body < N ? body : N - 1;
        double linear[N][3], linear_rate[N][3], momentum[N][3], turning[N][3], w[3], speed[3], lever[3], part[3];
        for (int k = 0; k < 3; k++) {
            w[k] = spin[last][k] + p.axis[last][k] * dq[last];
            lever[k] = p.com[body][k] - p.origin[last][k];
        }
        cross(w, lever, speed);
        for (int k = 0; k < 3; k++) speed[k] += origin_rate[last][k];
        for (int j = 0; j <= last; j++) {
            double lever_rate[3];
            for (int k = 0; k < 3; k++) {
                lever[k] = p.com[body][k] - p.origin[j][k];
                lever_rate[k] = speed[k] - origin_rate[j][k];
            }
            cross(p.axis[j], lever, linear[j]);
            cross(axis_rate[j], lever, linear_rate[j]);
            cross(p.axis[j], lever_rate, part);
            for (int k = 0; k < 3; k++) linear_rate[j][k] += part[k];
            rotate(p.inertia[body], p.axis[j], momentum[j]);
            rotate(p.inertia[body], axis_rate[j], turning[j]);
            cross(w, momentum[j], part);
            for (int k = 0; k < 3; k++) turning[j][k] += part[k];
        }
        for (int i = 0; i <= last; i++)
            for (int j = 0; j <= last; j++)
                matrix[N * i + j] += p.mass[body] * dot(linear[i], linear_rate[j], 3) + dot(p.axis[i], turning[j], 3);
    }
}
