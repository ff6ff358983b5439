/* Inverse kinematics next to known joint positions in C: what `TcpInverseKinematics.joints` computes in Python, which is the
   reference, with `heptarm.model.inverse_kinematics.raw`. */
#include <math.h>
#include <string.h>

enum { AXES = 7 };
static const double SINGULAR = 1e-10;

typedef double rows[3][3];

struct arm {
    double d_bs, d_se, d_ew, d_wf;
    /* tool frame to flange: translation, quaternion x y z w */
    double offset[3], turn[4];
};

/* Rounded as Python's: hardly ever otherwise than the exact result would be. */
static double norm(double x, double y) { return (double)sqrtl((long double)x * x + (long double)y * y); }

static void times(rows r, const rows a, const rows b) {
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) r[i][k] = a[i][0] * b[0][k] + a[i][1] * b[1][k] + a[i][2] * b[2][k];
}

static void transpose(rows r, const rows a) {
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) r[i][k] = a[k][i];
}

static void rotation(rows r, const double *q) {
    double x = q[0], y = q[1], z = q[2], w = q[3];
    r[0][0] = 1 - 2 * (y * y + z * z), r[0][1] = 2 * (x * y - w * z), r[0][2] = 2 * (x * z + w * y);
    r[1][0] = 2 * (x * y + w * z), r[1][1] = 1 - 2 * (x * x + z * z), r[1][2] = 2 * (y * z - w * x);
    r[2][0] = 2 * (x * z - w * y), r[2][1] = 2 * (y * z + w * x), r[2][2] = 1 - 2 * (x * x + y * y);
}

/* Rotation about the unit vector u (Rodrigues). */
static void about(rows r, const double *u, double angle) {
    double x = u[0], y = u[1], z = u[2], c = cos(angle), s = sin(angle), k = 1.0 - c;
    r[0][0] = c + x * x * k, r[0][1] = x * y * k - z * s, r[0][2] = x * z * k + y * s;
    r[1][0] = y * x * k + z * s, r[1][1] = c + y * y * k, r[1][2] = y * z * k - x * s;
    r[2][0] = z * x * k - y * s, r[2][1] = z * y * k + x * s, r[2][2] = c + z * z * k;
}

/* Rz(a) Ry(b). */
static void zy(rows r, double a, double b) {
    double ca = cos(a), sa = sin(a), cb = cos(b), sb = sin(b);
    r[0][0] = ca * cb, r[0][1] = -sa, r[0][2] = ca * sb;
    r[1][0] = sa * cb, r[1][1] = ca, r[1][2] = sa * sb;
    r[2][0] = -sb, r[2][1] = 0.0, r[2][2] = cb;
}

static double wrap(double angle) { return angle > M_PI ? angle - 2 * M_PI : angle <= -M_PI ? angle + 2 * M_PI : angle; }

static void zyz(double *v, const rows r, int negative, double near) {
    double s = norm(r[0][2], r[1][2]), a, b;
    int upright = r[2][2] >= 0;
    if (s < SINGULAR)
        a = near, b = upright ? 0.0 : negative ? -M_PI : M_PI;
    else if (negative)
        a = atan2(-r[1][2], -r[0][2]), b = -atan2(s, r[2][2]);
    else
        a = atan2(r[1][2], r[0][2]), b = atan2(s, r[2][2]);
    v[0] = a, v[1] = b;
    v[2] = upright ? wrap(atan2(r[1][0] - r[0][1], r[0][0] + r[1][1]) - a)
                   : wrap(a - atan2(-r[1][0] - r[0][1], r[1][1] - r[0][0]));
}

/* The branch whose first two angles are nearer to (near[0], near[1]). */
static void nearest(double *v, const rows r, const double *near) {
    double other[3];
    zyz(v, r, 0, near[0]);
    zyz(other, r, 1, near[0]);
    if (fabs(wrap(v[0] - near[0])) + fabs(v[1] - near[1]) > fabs(wrap(other[0] - near[0])) + fabs(other[1] - near[1]))
        memcpy(v, other, sizeof other);
}

/* Joint positions next to `near` for a tool frame at `point` with the orientation `quat`; 0: out of reach. */
int hi_joints(const struct arm *arm, double px, double py, double pz, double i, double j, double k, double w0, double e1,
              int status, const double *near, double *q) {
    double quat[4] = {i, j, k, w0}, p[3] = {px, py, pz}, w[3], unit[3];
    const double *o = arm->offset, *t = arm->turn;
    rows r, one, two, r03, r47;
    rotation(r, quat);
    for (int n = 0; n < 3; n++) p[n] = p[n] + r[n][0] * o[0] + r[n][1] * o[1] + r[n][2] * o[2];
    if (t[3] < 1.0) {
        double turned[4] = {w0 * t[0] + i * t[3] + j * t[2] - k * t[1], w0 * t[1] - i * t[2] + j * t[3] + k * t[0],
                            w0 * t[2] + i * t[1] - j * t[0] + k * t[3], w0 * t[3] - i * t[0] - j * t[1] - k * t[2]};
        rotation(r, turned);
    }
    for (int n = 0; n < 3; n++) w[n] = p[n] - arm->d_wf * r[n][2];
    w[2] -= arm->d_bs;
    double square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
    double far = arm->d_se + arm->d_ew, close = fabs(arm->d_se - arm->d_ew);
    double above = far * far - square, below = square - close * close;
    if (!(above >= -1e-9 && below >= -1e-9 && square >= 1e-9)) return 0;
    double q4 = 2.0 * atan2(sqrt(fmax(above, 0.0)), sqrt(fmax(below, 0.0)));
    if (status & 2) q4 = -q4;
    double radius = norm(w[0], w[1]), a1 = atan2(w[1], w[0]);
    if (status & 1) a1 += M_PI, radius = -radius;
    double a2 = atan2(radius, w[2]) - atan2(-arm->d_ew * sin(q4), arm->d_se + arm->d_ew * cos(q4));
    double length = sqrt(square);
    for (int n = 0; n < 3; n++) unit[n] = w[n] / length;
    about(one, unit, e1);
    zy(two, a1, a2);
    times(r03, one, two);
    nearest(q, r03, near);
    q[3] = q4;
    zy(two, 0.0, -q4);
    times(one, r03, two);
    transpose(two, one);
    times(r47, two, r);
    nearest(q + 4, r47, near + 4);
    return 1;
}
