/* Redundancy and inverse kinematics of an LBR.

   The pose of the flange fixes the wrist, and the wrist's distance from the shoulder fixes |A4|. One freedom is left: Sunrise's E1,
   the angle of A3, or the arm angle, the elbow's turn about the shoulder-wrist line (Shimizu, Kakuya, Yoon, Kitagaki, Kosuge,
   "Analytical Inverse Kinematic Computation for 7-DOF Redundant Manipulators With Joint Limits and Its Application to Redundancy
   Resolution", IEEE T-RO 24(5), 2008). With A3 the shoulder has two solutions (Status bit 0: the sign of the wrist's x in the axes
   of A1), the elbow two (bit 1: A4 < 0), the wrist two (bit 2: A6 <= 0): E1 and Status belong to one posture.

   Where axes coincide (A2, A4 or A6 near 0, the wrist above the shoulder) the closed forms take angles from the noise of the pose.
   The rule there: of all postures that reach the pose within TOLERANCE the nearest to `near`. `settle` finds it: regularised least
   squares from a posture (Tikhonov; Wampler 1986; Nakamura and Hanafusa 1986), with the largest regularisation that reaches the pose
   (the discrepancy principle, Morozov 1966), so that it moves no joint that it need not. */
#include "redundancy.h"

/* A pose is reached within this [m], [rad]. */
static const double TOLERANCE = 5e-10;
/* Squares of distances this far outside the reach are rounding errors [m2]. */
static const double ON_REACH = 1e-9;
/* Joints this far beyond a limit are on it; where the postures inside are far away, also at this distance: the noise of a measured
   pose. */
static const double ON_LIMIT = 1e-9, NEAR_LIMIT = 2e-5;
/* Joints this far from 0, and the wrist this far from the plane of A1 [m], have both signs for Status, and A3 so far from E1 is E1 if
   that spares a long way: next to a posture, where a measured pose has noise, and alone. */
static const double BOTH_SIGNS = 1e-4, NO_SIGN = 1e-9;
/* Where a posture is looked for when none is known: elbow down in front, wrist bent. */
static const double USUAL[N] = {0.0, 0.3, 0.0, -M_PI / 2, 0.0, M_PI / 3, 0.0};
/* The wrist in the plane of A1 is before it [m]. */
static const double IN_PLANE = 1e-10;
/* Where the smallest lever arm [m] or sine of a closed form is below it, another posture may be nearer. */
static const double VAGUE = 0.02;
/* With a given A3 the posture in the Status of `near` stands alone if it is so clear: `near` is then nearer to it than to the one in
   another Status, half of what makes it clear away. What TOLERANCE would allow instead is noise, which paths show as acceleration. */
static const double ALONE = 1e-4, NEAREST = 0.5;
/* Postures with A3 and Status of `near` are taken if they are at most so many times as far as the nearest one. */
static const double PREFERENCE = 5.0;
/* Distances this small are none [rad]. */
static const double SAME = 1e-7;
/* Beyond it a joint's move is worth a search for a nearer posture [rad]; a target so far away is not approached in steps. */
static const double LONG_WAY = M_PI / 2, FAR_AWAY = 1.0;
/* Largest step of the arm angle in that search [rad]. */
static const double STEP = M_PI / 18;
static const double NARROW = 1e-9;
enum { EVENTS = 28, ALL = 8 };
/* Whether A1, or A1 and A5, keep the values of `near` where the pose hardly determines them. */
enum { EXACT, KEEPS_A1, KEEPS_A1_A5 };

struct target {
    double turn[9], place[3], wrist[3], radius, square, bend; /* wrist from the shoulder; its distance from A1; |A4| */
};

static double wrap(double angle) { return angle - 2.0 * M_PI * ceil((angle - M_PI) / (2.0 * M_PI)); }

static double clamp(double value, double low, double high) { return value < low ? low : value > high ? high : value; }

/* Rows of Rz(a) Ry(b). */
static void zy(double a, double b, double *r) {
    double ca = cos(a), sa = sin(a), cb = cos(b), sb = sin(b);
    r[0] = ca * cb, r[1] = -sa, r[2] = ca * sb;
    r[3] = sa * cb, r[4] = ca, r[5] = sa * sb;
    r[6] = -sb, r[7] = 0.0, r[8] = cb;
}

static void times(const double *a, const double *b, double *r) {
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) r[3 * i + k] = a[3 * i] * b[k] + a[3 * i + 1] * b[3 + k] + a[3 * i + 2] * b[6 + k];
}

/* a' b */
static void transposed_times(const double *a, const double *b, double *r) {
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) r[3 * i + k] = a[i] * b[k] + a[3 + i] * b[3 + k] + a[6 + i] * b[6 + k];
}

/* Wrist in the axes of the upper arm: its x and z. */
static void forearm(const struct arm *arm, double q4, double *x, double *z) {
    *x = -arm->d_ew * sin(q4);
    *z = arm->d_se + arm->d_ew * cos(q4);
}

/* Where the pose puts the wrist; 0: out of reach. The half-angle form of the elbow is accurate near the straight arm. */
static int aim(const struct arm *arm, const double *turn, const double *place, struct target *t) {
    double *w = t->wrist;
    memcpy(t->turn, turn, sizeof t->turn);
    memcpy(t->place, place, sizeof t->place);
    for (int k = 0; k < 3; k++) w[k] = place[k] - arm->d_wf * turn[3 * k + 2];
    w[2] -= arm->d_bs;
    t->radius = sqrt(w[0] * w[0] + w[1] * w[1]);
    t->square = dot(w, w, 3);
    double far = arm->d_se + arm->d_ew, close = arm->d_se - arm->d_ew;
    double above = far * far - t->square, below = t->square - close * close;
    if (!(above >= -ON_REACH && below >= -ON_REACH && t->square >= ON_REACH)) return 0;
    t->bend = 2.0 * atan2(sqrt(fmax(above, 0.0)), sqrt(fmax(below, 0.0)));
    return 1;
}

/* Angles a, b, c of r = Rz(a) Ry(b) Rz(c) with b of the wanted sign; returns |sin b|, below which a is `near`.

   c comes from a + c = atan2(r10 - r01, r00 + r11), or where b is near pi from a - c, so that r is reproduced to the last digits
   however little b determines a. */
static double zyz(const double *r, int is_negative, double near, double *v) {
    double size = sqrt(r[2] * r[2] + r[5] * r[5]), sign = is_negative ? -1.0 : 1.0;
    v[0] = size < 1e-13 ? near : atan2(sign * r[5], sign * r[2]);
    v[1] = sign * atan2(size, r[8]);
    v[2] = r[8] >= 0.0 ? wrap(atan2(r[3] - r[1], r[0] + r[4]) - v[0]) : wrap(v[0] - atan2(-r[3] - r[1], r[4] - r[0]));
    return size;
}

/* The same with a = near wherever b is small: not the exact rotation, but near to it. */
static void zyz_near(const double *r, double near, double *v) {
    v[0] = near;
    v[1] = cos(near) * r[2] + sin(near) * r[5];
    v[2] = wrap(atan2(r[3] - r[1], r[0] + r[4]) - near);
}

/* A5 to A7 for the first four joints; returns how well they are determined, 0 to 1. */
static double turn_hand(const struct target *t, int is_negative, const double *near, int keeps, double *q) {
    double upper[9], back[9], hand[9], c = cos(q[2]), s = sin(q[2]), spin[9] = {c, -s, 0, s, c, 0, 0, 0, 1};
    zy(q[0], q[1], upper);
    times(upper, spin, back);
    zy(0.0, -q[3], upper);
    times(back, upper, spin);
    transposed_times(spin, t->turn, hand);
    if (keeps == KEEPS_A1_A5 && hand[8] > 0.0) {
        zyz_near(hand, near[4], q + 4);
        return 1.0;
    }
    return zyz(hand, is_negative, near[4], q + 4);
}

/* The posture with this A3 in a Status. Returns how well the pose determines it: its smallest lever arm [m] or sine; negative: there
   is none. */
static double with_a3(const struct arm *arm, const struct target *t, double a3, int status, const double *near, int keeps, double *q) {
    double x, z, s = sin(a3), c = cos(a3);
    q[2] = a3;
    q[3] = status & 2 ? -t->bend : t->bend;
    forearm(arm, q[3], &x, &z);
    double side = x * s, square = t->radius * t->radius - side * side, ahead = 0.0;
    if (square < -1e-4) return -1.0;
    if (square > 0.0) ahead = status & 1 ? -sqrt(square) : sqrt(square);
    q[1] = wrap(atan2(ahead, t->wrist[2]) - atan2(x * c, z));
    if (t->radius < (keeps ? VAGUE : 1e-13))
        q[0] = near[0];
    else
        q[0] = wrap(atan2(t->wrist[1], t->wrist[0]) - atan2(side, ahead));
    return fmin(fabs(ahead), turn_hand(t, status & 4, near, keeps, q));
}

/* Of the arm with A3 = 0 whose wrist is at the target: R03. */
static void reference(const struct arm *arm, const struct target *t, double q4, int is_behind, double *r03) {
    double x, z, a1 = t->radius > 0.0 ? atan2(t->wrist[1], t->wrist[0]) : 0.0, radius = t->radius;
    if (is_behind) a1 += M_PI, radius = -radius;
    forearm(arm, q4, &x, &z);
    zy(a1, atan2(radius, t->wrist[2]) - atan2(x, z), r03);
}

/* Rodrigues' rotation of the columns of r about u. */
static void about(const double *u, double angle, const double *r, double *into) {
    double c = cos(angle), s = sin(angle), k = 1.0 - c, x = u[0], y = u[1], z = u[2];
    double turn[9] = {c + x * x * k,     x * y * k - z * s, x * z * k + y * s, y * x * k + z * s, c + y * y * k,
                      y * z * k - x * s, z * x * k - y * s, z * y * k + x * s, c + z * z * k};
    times(turn, r, into);
}

static void direction(const struct target *t, double *u) {
    for (int k = 0; k < 3; k++) u[k] = t->wrist[k] / sqrt(t->square);
}

/* The posture with this arm angle, measured from the reference arm of Status bit 0, in a Status. */
static void with_arm_angle(const struct arm *arm, const struct target *t, double angle, int status, const double *near, double *q) {
    double r03[9], start[9], u[3];
    q[3] = status & 2 ? -t->bend : t->bend;
    reference(arm, t, q[3], status & 1, start);
    direction(t, u);
    about(u, angle, start, r03);
    zyz(r03, 0, near[0], q);
    double ahead = t->wrist[0] * cos(q[0]) + t->wrist[1] * sin(q[0]);
    if (fabs(ahead) < IN_PLANE ? cos(q[0]) * start[4] - sin(q[0]) * start[1] < 0.0 : (ahead < 0.0) != (status & 1))
        zyz(r03, 1, near[0], q);
    turn_hand(t, status & 4, near, EXACT, q);
}

/* Wrist from the shoulder, in the axes of A1: its x. */
static double ahead_of(const struct arm *arm, const double *q) {
    double x, z;
    forearm(arm, q[3], &x, &z);
    return cos(q[1]) * x * cos(q[2]) + sin(q[1]) * z;
}

int hi_status(const struct arm *arm, const double *q) {
    return (ahead_of(arm, q) < -IN_PLANE) | (q[3] < 0.0) << 1 | (q[5] <= 0.0) << 2;
}

/* Arm angle [rad]: the turn of the elbow about the shoulder-wrist line, from the arm with A3 = 0 in the same Status. */
double hi_arm_angle(const struct arm *arm, const double *q) {
    struct frames f;
    struct target t;
    double start[9], r03[9], u[3], between[9], c = cos(q[2]), s = sin(q[2]), spin[9] = {c, -s, 0, s, c, 0, 0, 0, 1};
    walk(&arm->chain, q, &f);
    for (int k = 0; k < 3; k++) t.wrist[k] = f.origin[5][k];
    t.wrist[2] -= arm->d_bs;
    t.radius = sqrt(t.wrist[0] * t.wrist[0] + t.wrist[1] * t.wrist[1]);
    t.square = dot(t.wrist, t.wrist, 3);
    reference(arm, &t, q[3], ahead_of(arm, q) < -IN_PLANE, start);
    zy(q[0], q[1], between);
    times(between, spin, r03);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) between[3 * i + k] = dot(r03 + 3 * i, start + 3 * k, 3);
    direction(&t, u);
    double axial = (between[7] - between[5]) * u[0] + (between[2] - between[6]) * u[1] + (between[3] - between[1]) * u[2];
    return atan2(axial, between[0] + between[4] + between[8] - 1.0);
}

/* Whether a posture is in a Status; on the border, so wide, it is in both. */
static int is_in(const struct arm *arm, const double *q, int status, double border) {
    double values[3] = {-ahead_of(arm, q), -q[3], -q[5]};
    for (int bit = 0; bit < 3; bit++)
        if (fabs(values[bit]) > border && (values[bit] > 0.0) != (status >> bit & 1)) return 0;
    return 1;
}

/* --------------------------------------------------------------------------------------------------- the nearest posture */

static double distance(const double *q, const double *other) {
    double sum = 0.0;
    for (int i = 0; i < N; i++) sum += (q[i] - other[i]) * (q[i] - other[i]);
    return sqrt(sum);
}

static double largest_move(const double *q, const double *other) {
    double most = 0.0;
    for (int i = 0; i < N; i++) most = fmax(most, fabs(q[i] - other[i]));
    return most;
}

static double excess(const struct arm *arm, const double *q) {
    double most = 0.0;
    for (int i = 0; i < N; i++) most = fmax(most, fmax(q[i] - arm->q_max[i], arm->q_min[i] - q[i]));
    return most;
}

/* How far a posture is from the pose [m], [rad], and the Jacobian there. */
static double miss(const struct arm *arm, const struct target *t, const double *q, double *error, double j[6][N]) {
    struct frames f;
    double most = 0.0;
    walk(&arm->chain, q, &f);
    for (int k = 0; k < 3; k++) error[k] = t->place[k] - f.place[k];
    turn_between(f.turn, t->turn, error + 3);
    for (int k = 0; k < 6; k++) most = fmax(most, fabs(error[k]));
    jacobian(f.axis, f.origin, f.place, j);
    return most;
}

/* Adds J' (J J' + damping² 1)^-1 error to q; held joints stay. */
static int correct(double j[6][N], const int *is_held, double damping, double *error, double *q) {
    double square[36];
    for (int i = 0; i < N; i++)
        if (is_held[i])
            for (int r = 0; r < 6; r++) j[r][i] = 0.0;
    for (int r = 0; r < 6; r++)
        for (int c = 0; c <= r; c++) square[6 * r + c] = dot(j[r], j[c], N) + (r == c ? damping * damping : 0.0);
    if (!factorise(square, 6)) return 0;
    solve(square, 6, error);
    for (int i = 0; i < N; i++)
        for (int r = 0; r < 6; r++) q[i] += j[r][i] * error[r];
    return 1;
}

enum { ROUNDS = 60, POLISHES = 8 };

/* Makes a posture within TOLERANCE as exact as it can be without moving: what is hardly determined stays. */
static int polish(const struct arm *arm, const struct target *t, const int *is_held, double *q) {
    double error[6], j[6][N], before = miss(arm, t, q, error, j), damping = 1e-2;
    for (int round = 0; round < POLISHES && before > 1e-14; round++, damping = fmax(0.1 * damping, 1e-7)) {
        double next[N];
        memcpy(next, q, sizeof next);
        if (!correct(j, is_held, damping, error, next) || largest_move(next, q) > 5.0 * SAME) break;
        double now = miss(arm, t, next, error, j);
        if (!(now < before)) break;
        memcpy(q, next, sizeof next);
        before = now;
    }
    return 1;
}

/* The posture that reaches the pose with the least move from `q`; returns whether there is one. Held joints stay. */
static int settle(const struct arm *arm, const struct target *t, const int *is_held, double *q) {
    double start[N], error[6], j[6][N], damping = 0.1, before = INFINITY;
    memcpy(start, q, sizeof start);
    for (int round = 0; round < ROUNDS; round++) {
        double now = miss(arm, t, q, error, j);
        if (!(now < INFINITY)) return 0;
        if (now <= TOLERANCE) return polish(arm, t, is_held, q);
        if (round && now > 0.3 * before) damping = fmax(0.3 * damping, 3e-8);
        before = now;
        for (int r = 0; r < 6; r++)
            for (int i = 0; i < N; i++) error[r] += is_held[i] ? 0.0 : j[r][i] * (q[i] - start[i]);
        for (int i = 0; i < N; i++) q[i] = start[i];
        if (!correct(j, is_held, damping, error, q)) return 0;
    }
    return 0;
}

/* Candidates are offered one by one; each class has its nearest. */
enum { KEEPS_BOTH, KEEPS_A3, ANY, CLASSES };

struct search {
    const struct arm *arm;
    const struct target *target;
    const struct request *request;
    double a3, border;
    const double *near;
    int status; /* that of the request or of `near` */
    double q[CLASSES][N], distance[CLASSES], least;
    double beyond[N], beyond_distance; /* nearest of those just beyond a limit */
};

static void offer(struct search *s, const double *q) {
    const struct request *request = s->request;
    int in_status = is_in(s->arm, q, s->status, s->border), keeps_a3 = fabs(q[2] - s->a3) <= SAME;
    if ((request->status >= 0 && !in_status) || (request->is_fixed && fabs(q[2] - s->a3) > (request->is_unlimited ? SAME : s->border))) return;
    double away = distance(q, s->near), outside = request->is_unlimited ? 0.0 : excess(s->arm, q);
    if (outside > ON_LIMIT) {
        if (outside <= NEAR_LIMIT && away < s->beyond_distance) {
            s->beyond_distance = away;
            memcpy(s->beyond, q, sizeof s->beyond);
        }
        return;
    }
    int class = !keeps_a3 ? ANY : in_status ? KEEPS_BOTH : KEEPS_A3;
    if (away < s->distance[class]) {
        s->distance[class] = away;
        memcpy(s->q[class], q, sizeof s->q[class]);
    }
    s->least = fmin(s->least, away);
}

/* Offers the posture nearest to `start`; where it is beyond limits, the nearest with those joints on their limits. */
static void offer_settled(struct search *s, const double *start, int holds_a3) {
    int is_held[N] = {0, 0, holds_a3, 0, 0, 0, 0};
    double from[N], q[N];
    memcpy(from, start, sizeof from);
    for (int attempt = 0; attempt < 3; attempt++) {
        int is_outside = 0;
        memcpy(q, from, sizeof q);
        if (!settle(s->arm, s->target, is_held, q)) return;
        offer(s, q);
        for (int i = 0; i < N && !s->request->is_unlimited; i++) {
            double inside = clamp(q[i], s->arm->q_min[i], s->arm->q_max[i]);
            if (fabs(q[i] - inside) <= ON_LIMIT) continue;
            if (is_held[i]) return;
            is_outside = is_held[i] = 1;
            from[i] = inside;
        }
        if (!is_outside) return;
    }
}

/* Solutions of s sin + k cos + c = 0. */
static int add_roots(double s, double k, double c, double *found, int count) {
    double size = sqrt(s * s + k * k);
    if (size < 1e-12 || fabs(c) > size * (1.0 + 1e-12)) return count;
    double middle = atan2(s, k), half = acos(clamp(-c / size, -1.0, 1.0));
    found[count++] = wrap(middle + half);
    found[count++] = wrap(middle - half);
    return count;
}

/* Events of the three joints of R = Rz(a) Ry(b) Rz(c) whose entries are waves of the arm angle; the limits are symmetric. */
static int add_joint_events(const double r[3][9], const double *limits, double *found, int count) {
    double s = r[0][8], k = r[1][8], o = r[2][8];
    /* cos b = r22 meets cos(limit); at its extremes b may pass through 0, where a and c jump by pi */
    count = add_roots(s, k, o - cos(limits[1]), found, count);
    if (sqrt(s * s + k * k) > 1e-12) {
        found[count++] = atan2(s, k);
        found[count++] = atan2(-s, -k);
    }
    for (int side = -1; side <= 1; side += 2) {
        double wave[3], c = cos(limits[0]), g = side * sin(limits[0]);
        for (int n = 0; n < 3; n++) wave[n] = c * r[n][5] - g * r[n][2]; /* tan a = r12 / r02 */
        count = add_roots(wave[0], wave[1], wave[2], found, count);
        c = cos(limits[2]), g = side * sin(limits[2]);
        for (int n = 0; n < 3; n++) wave[n] = c * r[n][7] + g * r[n][6]; /* tan c = r21 / -r20 */
        count = add_roots(wave[0], wave[1], wave[2], found, count);
    }
    return count;
}

/* Arm angles, ascending, at which a joint may meet a limit or a branch may change: between neighbours nothing changes. With the
   wrist and the flange fixed, the rotations of shoulder and wrist are R = S sin + K cos + C (Shimizu et al., section IV). */
static int find_events(const struct arm *arm, const struct target *t, double q4, int is_behind, double *found) {
    double start[9], u[3], shoulder[3][9], wrist[3][9], back[9], turned[9];
    reference(arm, t, q4, is_behind, start);
    direction(t, u);
    for (int k = 0; k < 3; k++) {
        double column[3] = {start[k], start[3 + k], start[6 + k]}, part[3], along = dot(u, column, 3);
        cross(u, column, part);
        for (int i = 0; i < 3; i++) {
            shoulder[0][3 * i + k] = part[i];
            shoulder[1][3 * i + k] = column[i] - along * u[i];
            shoulder[2][3 * i + k] = along * u[i];
        }
    }
    zy(0.0, q4, back);
    for (int n = 0; n < 3; n++) {
        transposed_times(shoulder[n], t->turn, turned);
        times(back, turned, wrist[n]);
    }
    int count = add_joint_events(shoulder, arm->q_max, found, 0);
    count = add_joint_events(wrist, arm->q_max + 4, found, count);
    double wave[3]; /* Status bit 0 changes where the wrist crosses the plane of A1 */
    for (int n = 0; n < 3; n++) wave[n] = t->wrist[0] * shoulder[n][2] + t->wrist[1] * shoulder[n][5];
    count = add_roots(wave[0], wave[1], wave[2], found, count);
    for (int i = 1; i < count; i++) {
        double value = found[i];
        int k = i;
        for (; k && found[k - 1] > value; k--) found[k] = found[k - 1];
        found[k] = value;
    }
    return count;
}

/* Arm angles within the joint limits in a Status: pairs of low and high, ascending; one that passes pi goes on above it. */
static int find_intervals(const struct arm *arm, const struct target *t, int status, double *spans) {
    static const double none[N];
    double marks[2 * EVENTS], q[N], q4 = status & 2 ? -t->bend : t->bend;
    if (t->bend > arm->q_max[3] + ON_LIMIT) return 0;
    int count = find_events(arm, t, q4, status & 1, marks), found = 0;
    if (!count) {
        with_arm_angle(arm, t, 0.0, status, none, q);
        spans[0] = -M_PI, spans[1] = M_PI;
        return excess(arm, q) <= ON_LIMIT;
    }
    marks[count] = marks[0] + 2.0 * M_PI;
    for (int i = 0; i < count; i++) {
        with_arm_angle(arm, t, 0.5 * (marks[i] + marks[i + 1]), status, none, q);
        if (excess(arm, q) > ON_LIMIT) continue;
        if (found && marks[i] - spans[2 * found - 1] <= NARROW)
            spans[2 * found - 1] = marks[i + 1];
        else
            spans[2 * found] = marks[i], spans[2 * found + 1] = marks[i + 1], found++;
    }
    if (found > 1 && spans[0] + 2.0 * M_PI - spans[2 * found - 1] <= NARROW) { /* the last goes on in the first */
        double end = spans[1] + 2.0 * M_PI;
        memmove(spans, spans + 2, 2 * (found - 1) * sizeof *spans);
        spans[2 * --found - 1] = end;
    }
    return found;
}

/* The best of a search over arm angles, and between which ones it lies. */
struct best {
    double away, angle, low, high;
    int status;
};

static double away_at(struct search *s, double angle, int status, double *q) {
    with_arm_angle(s->arm, s->target, angle, status, s->near, q);
    return !s->request->is_unlimited && excess(s->arm, q) > ON_LIMIT ? INFINITY : distance(q, s->near);
}

static void sweep_status(struct search *s, int status, struct best *best) {
    double spans[2 * EVENTS] = {-M_PI, M_PI}, q[N];
    int count = s->request->is_unlimited ? 1 : find_intervals(s->arm, s->target, status, spans);
    for (int n = 0; n < count; n++) {
        int steps = 1 + (int)((spans[2 * n + 1] - spans[2 * n]) / STEP);
        double step = (spans[2 * n + 1] - spans[2 * n]) / steps;
        for (int i = 0; i < steps; i++) {
            double here = spans[2 * n] + (i + 0.5) * step, away = away_at(s, here, status, q);
            if (away < best->away)
                *best = (struct best){away, here, fmax(here - step, spans[2 * n]), fmin(here + step, spans[2 * n + 1]), status};
        }
    }
}

/* Offers the nearest posture of all arm angles: golden section about the best of a grid. */
static void offer_sweep(struct search *s) {
    struct best best = {.away = INFINITY};
    double q[N];
    for (int status = 0; status < ALL; status++)
        if (s->request->status < 0 || status == s->request->status) sweep_status(s, status, &best);
    if (!(best.away < INFINITY)) return;
    for (int round = 0; round < 40; round++) {
        int is_below = best.angle - best.low > best.high - best.angle;
        double other = best.angle + 0.38196601125010515 * ((is_below ? best.low : best.high) - best.angle);
        double away = away_at(s, other, best.status, q);
        if (away < best.away) {
            *(is_below ? &best.high : &best.low) = best.angle;
            best.away = away, best.angle = other;
        } else {
            *(is_below ? &best.low : &best.high) = other;
        }
    }
    away_at(s, best.angle, best.status, q);
    offer(s, q);
}

/* The least move to the pose if the arm were as its Jacobian at `near` says. */
static double estimate(const struct arm *arm, const struct target *t, const double *near) {
    static const int none[N];
    double error[6], j[6][N], q[N];
    memcpy(q, near, sizeof q);
    miss(arm, t, q, error, j);
    return correct(j, none, 0.05, error, q) ? distance(q, near) : 0.0;
}

static int take(const struct search *s, const double *found, double *q) {
    for (int i = 0; i < N; i++) q[i] = s->request->is_unlimited ? found[i] : clamp(found[i], s->arm->q_min[i], s->arm->q_max[i]);
    return FOUND;
}

static int is_found(const struct search *s) { return fmin(s->least, s->beyond_distance) < INFINITY; }

static int choose(const struct search *s) {
    for (int class = 0; class < ANY; class++)
        if (s->distance[class] <= PREFERENCE * s->least + SAME) return class;
    return ANY;
}

/* Offers the postures next to `near` and those that the closed forms give. */
static void offer_all(struct search *s) {
    const struct request *request = s->request;
    const double *near = s->near;
    int is_exact = request->is_fixed && request->is_unlimited;
    double first[N], loose[N];
    memcpy(first, near, sizeof first);
    first[2] = s->a3;
    if (estimate(s->arm, s->target, near) < FAR_AWAY) {
        if (!is_exact) offer_settled(s, request->is_fixed ? first : near, 0);
        offer_settled(s, first, 1);
    }
    for (int status = 0; status < ALL; status++) {
        double error[6], j[6][N], clear = with_a3(s->arm, s->target, s->a3, status, near, EXACT, first);
        if (clear < 0.0) continue;
        if (clear > VAGUE || miss(s->arm, s->target, first, error, j) <= TOLERANCE) offer(s, first);
        if (clear > VAGUE) continue;
        with_a3(s->arm, s->target, s->a3, status, near, KEEPS_A1_A5, loose);
        if (distance(loose, near) >= s->least) continue;
        offer_settled(s, loose, 1);
        if (!is_exact) offer_settled(s, loose, 0);
    }
    if (!request->is_fixed && (!(s->least < INFINITY) || largest_move(s->q[choose(s)], near) > LONG_WAY)) offer_sweep(s);
}

/* The wrist above the shoulder leaves A1 free: offers postures with others than that of `near`, from which the hand cannot turn so
   far (A2 = A4 = 0: A1 + A5 is given, and may be half a turn). */
static void offer_turned(struct search *s) {
    double from[N], q[N], error[6], j[6][N];
    memcpy(from, s->near, sizeof from);
    for (from[0] = s->arm->q_min[0]; from[0] <= s->arm->q_max[0]; from[0] += STEP)
        for (int status = 0; status < ALL; status++) {
            if (with_a3(s->arm, s->target, s->a3, status, from, KEEPS_A1, q) < 0.0) continue;
            if (miss(s->arm, s->target, q, error, j) <= TOLERANCE)
                offer(s, q);
            else
                offer_settled(s, q, 1);
        }
}

/* Joint positions for a pose of the flange, rotation by rows and place [m]. Returns FOUND, TOO_FAR or NO_POSTURE. */
int find_joints(const struct arm *arm, const double *turn, const double *place, const struct request *request, double *q) {
    struct target target;
    const double *near = request->near ? request->near : USUAL;
    if (!aim(arm, turn, place, &target)) return TOO_FAR;
    struct search s = {.arm = arm, .target = &target, .request = request, .near = near, .least = INFINITY, .beyond_distance = INFINITY};
    s.a3 = isnan(request->a3) ? near[2] : wrap(request->a3);
    s.border = request->near ? BOTH_SIGNS : NO_SIGN;
    s.status = request->status < 0 ? hi_status(arm, near) : request->status;
    for (int class = 0; class < CLASSES; class++) s.distance[class] = INFINITY;
    /* on a path A3 has no noise of a measurement: another A3 each time would add up */
    int is_given = request->is_fixed && request->status >= 0, is_exact = request->is_fixed && request->is_unlimited;
    double first[N];
    /* the usual case: the posture with A3 and Status is clear, and moves no joint farther than it must */
    double clear = with_a3(arm, &target, s.a3, s.status, near, EXACT, first), most = largest_move(first, near);
    if (is_exact && clear > ALONE && most <= NEAREST * clear) return take(&s, first, q);
    if (clear > (is_given && !request->near ? NO_SIGN : VAGUE) && (request->is_unlimited || excess(arm, first) <= ON_LIMIT)) {
        if (is_given || most <= SAME || (most <= LONG_WAY && distance(first, near) <= PREFERENCE * estimate(arm, &target, near))) return take(&s, first, q);
    }
    offer_all(&s);
    if (!is_found(&s) && s.border < BOTH_SIGNS) { /* a straight arm has the noise of the pose as 1e-8 rad in A4 to A6 */
        s.border = BOTH_SIGNS;
        offer_all(&s);
    }
    if (!is_found(&s) && target.radius < BOTH_SIGNS) offer_turned(&s);
    if (!is_found(&s)) return NO_POSTURE;
    return take(&s, s.least <= PREFERENCE * s.beyond_distance + SAME ? s.q[choose(&s)] : s.beyond, q);
}

/* ---------------------------------------------------------------------------------------------------------- for Python and C++ */

static void split(const double *pose, double *turn, double *place) {
    for (int i = 0; i < 3; i++) {
        memcpy(turn + 3 * i, pose + 4 * i, 3 * sizeof *turn);
        place[i] = pose[4 * i + 3];
    }
}

/* Homogeneous matrices; for each of them one a3, Status and near, or no near at all. */
void hi_solve(const struct arm *arm, long count, const double *poses, const double *a3, const int *status, const double *near, int is_fixed,
              double *q, int *outcome) {
    for (long n = 0; n < count; n++) {
        double turn[9], place[3];
        struct request request = {a3[n], is_fixed, status[n], 0, near ? near + N * n : NULL};
        split(poses + 16 * n, turn, place);
        outcome[n] = find_joints(arm, turn, place, &request, q + N * n);
    }
}

/* The posture with an arm angle in a Status; limits are not checked. 0: out of reach. */
int hi_with_arm_angle(const struct arm *arm, const double *pose, double angle, int status, const double *near, double *q) {
    struct target target;
    double turn[9], place[3];
    split(pose, turn, place);
    if (!aim(arm, turn, place, &target)) return 0;
    with_arm_angle(arm, &target, angle, status, near, q);
    return 1;
}

/* Intervals of arm angles within the limits; -1: out of reach. `spans` has room for 28 pairs. */
int hi_intervals(const struct arm *arm, const double *pose, int status, double *spans) {
    struct target target;
    double turn[9], place[3];
    split(pose, turn, place);
    return aim(arm, turn, place, &target) ? find_intervals(arm, &target, status, spans) : -1;
}

/* Status of many postures. */
void hi_statuses(const struct arm *arm, long count, const double *q, int *status) {
    for (long n = 0; n < count; n++) status[n] = hi_status(arm, q + N * n);
}

/* Tool frame on a path: flange in the tool frame, translation and quaternion x y z w. */
struct tool {
    double offset[3], turn[4];
};

/* Joint positions next to `near` for the tool frame at a point with an orientation x y z w; limits are not checked. */
int hi_joints(const struct arm *arm, const struct tool *tool, double x, double y, double z, double i, double j, double k, double w, double a3,
              int is_fixed, const double *near, double *q) {
    double quat[4] = {i, j, k, w}, frame[9], turn[9], place[3] = {x, y, z}, offset[3];
    const double *t = tool->turn;
    struct request request = {a3, is_fixed, -1, 1, near};
    rotation(quat, frame);
    rotate(frame, tool->offset, offset);
    for (int n = 0; n < 3; n++) place[n] += offset[n];
    double turned[4] = {w * t[0] + i * t[3] + j * t[2] - k * t[1], w * t[1] - i * t[2] + j * t[3] + k * t[0],
                        w * t[2] + i * t[1] - j * t[0] + k * t[3], w * t[3] - i * t[0] - j * t[1] - k * t[2]};
    rotation(turned, turn);
    return find_joints(arm, turn, place, &request, q);
}
