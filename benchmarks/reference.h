/* Common code of the two reference programs: board, encoders, laws and the linear machine.
 *
 * Hand-written C for these machines: structs, loops, doubles, static arrays. It measures the cost of the tick
 * without rtctl. The including file defines NQ, NU, NX and the parameters.
 */

#include <math.h>
#include <stdatomic.h>
#include <stdint.h>
#include <string.h>
#include <time.h>

#define FIELD_REAL(name) double name;
#define FIELD_WHOLE(name) int64_t name;
#define NAME(name) #name " "

static inline double lower(double a, double b) { return a < b ? a : b; }
static inline double higher(double a, double b) { return a > b ? a : b; }
static inline double clamp(double x, double low, double high) { return lower(higher(x, low), high); }

/* ---- command and safety ---- */

enum { IDLE, ARMED, RUNNING, TRIPPED };
enum { NONE, LINK, FROZEN, FOLLOWING, TENSION, CURRENT, NOT_A_NUMBER, MISSED, COMMANDER, START_UP, SUPERVISOR, SENSORS };

struct command {
    int64_t arm, disarm, reset, gains, play, commander_lost, setpoint, order;
    double target, rate;
};

struct mailbox {
    _Atomic int64_t count;
    int64_t seen;
    struct command command;
};

struct safety_limits {
    int64_t link, frozen, tension, current_time, missed;
    double frozen_effort, following, tension_min, tension_max, current, disagreement, fade;
};

struct safety {
    int64_t state, trip, trip_tick, arm, disarm, reset, armed_for, silent, still, over, slack, late, counts, on;
    double hold[2], gate, apart;
};

static void take(struct mailbox *box, struct command *c)
{
    int64_t count = atomic_load_explicit(&box->count, memory_order_acquire);
    if (count == box->seen || count % 2 == 1)
        return;
    struct command copy = box->command;
    if (atomic_load_explicit(&box->count, memory_order_acquire) != count)
        return;
    *c = copy;
    box->seen = count;
}

static void trip(struct safety *s, int cause, int64_t k)
{
    if (s->state == ARMED || s->state == RUNNING) {
        s->state = TRIPPED;
        s->trip = cause;
        s->trip_tick = k;
    }
}

static void obey(struct safety *s, const struct command *c)
{
    s->on = 0;
    if (c->reset != s->reset) {
        s->reset = c->reset;
        if (s->state == TRIPPED) {
            s->state = IDLE;
            s->trip = NONE;
        }
    }
    if (c->disarm != s->disarm) {
        s->disarm = c->disarm;
        if (s->state != TRIPPED)
            s->state = IDLE;
    }
    if (c->arm != s->arm) {
        s->arm = c->arm;
        if (s->state == IDLE) {
            s->state = ARMED;
            s->on = 1;
            s->gate = 1.0;
            s->hold[0] = s->hold[1] = 0.0;
            s->armed_for = s->silent = s->still = s->over = s->slack = s->late = 0;
        }
    }
    if (s->state == ARMED)
        s->armed_for++;
}

static void check_timing(const struct safety_limits *p, struct safety *s, const struct command *c, int fresh, int late,
                         int64_t k)
{
    s->silent = fresh > 0 ? 0 : s->silent + 1;
    s->late = late ? s->late + 1 : 0;
    if (s->silent > p->link)
        trip(s, LINK, k);
    if (p->missed > 0 && s->late >= p->missed)
        trip(s, MISSED, k);
    if (c->commander_lost)
        trip(s, COMMANDER, k);
}

static void check_sensors(const struct safety_limits *p, struct safety *s, double apart, int64_t k)
{
    if (s->on)
        s->apart = apart;
    if (p->disagreement > 0.0 && fabs(apart - s->apart) > p->disagreement)
        trip(s, SENSORS, k);
}

static void check_motion(const struct safety_limits *p, struct safety *s, double error, int64_t counts, double effort,
                         double amperes, int64_t k)
{
    double total = error + effort + amperes;
    if (total != total || fabs(total) > 1e300)
        trip(s, NOT_A_NUMBER, k);
    if (p->following > 0.0 && fabs(error) > p->following)
        trip(s, FOLLOWING, k);
    s->still = counts == s->counts && fabs(effort) > p->frozen_effort ? s->still + 1 : 0;
    s->counts = counts;
    if (p->frozen > 0 && s->still > p->frozen)
        trip(s, FROZEN, k);
    s->over = amperes > p->current ? s->over + 1 : 0;
    if (p->current_time > 0 && s->over > p->current_time)
        trip(s, CURRENT, k);
}

static void fade(const struct safety_limits *p, struct safety *s)
{
    if (s->state == TRIPPED)
        s->gate = higher(s->gate - p->fade, 0.0);
}

static double gate(struct safety *s, double u, int channel)
{
    if (s->state == ARMED || s->state == RUNNING)
        return s->hold[channel] = u == u ? u : 0.0;
    return s->state == TRIPPED ? s->hold[channel] * s->gate : 0.0;
}

/* ---- times of the tick: every sixteenth is measured, into buckets of 32 to the octave ---- */

struct histogram {
    int64_t count, max, bucket[32 * 33];
};

static int64_t now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * INT64_C(1000000000) + t.tv_nsec;
}

static void count_time(struct histogram *h, int64_t ns)
{
    int exponent;
    h->count++;
    if (ns > h->max)
        h->max = ns;
    frexp((double)ns, &exponent);
    int octave = exponent - 6;
    h->bucket[ns < 32 ? ns : 32 * octave + (ns >> octave)]++;
}

static struct {
    int on;
    int64_t begun, read, law;
    struct histogram reading, deciding, writing, publishing, whole;
} timing;

static void count_stages(int64_t wrote)
{
    int64_t done = now();
    count_time(&timing.reading, timing.read - timing.begun);
    count_time(&timing.deciding, timing.law - timing.read);
    count_time(&timing.writing, wrote - timing.law);
    count_time(&timing.publishing, done - wrote);
    count_time(&timing.whole, done - timing.begun);
}

/* ---- laws ---- */

struct reference {
    double ref, origin;
    int64_t direction, mode, k0, i, seen;
};

enum { PLAY, HOLD, MOVE };

static double table(const double *t_, const double *r, int64_t n, double dt, struct reference *s, int64_t k)
{
    double t = (k - s->k0) * dt;
    if (t < t_[s->i])
        s->i = 0;
    while (s->i + 1 < n && t_[s->i + 1] <= t)
        s->i++;
    int64_t i = s->i;
    if (i + 1 == n || t < t_[i])
        return r[i];
    return r[i] + (r[i + 1] - r[i]) * (t - t_[i]) / (t_[i + 1] - t_[i]);
}

static double follow_reference(const double *t, const double *r, int64_t n, double dt, struct reference *s,
                               const struct command *c, int64_t k)
{
    if (c->setpoint != s->seen) {
        s->seen = c->setpoint;
        s->mode = MOVE;
    }
    double ref = s->ref;
    if (s->mode == PLAY) {
        ref = s->origin + table(t, r, n, dt, s, k);
    } else if (s->mode == MOVE) {
        double most = c->rate > 0.0 ? c->rate * dt : INFINITY;
        ref += clamp(c->target - ref, -most, most);
    }
    if (ref > s->ref)
        s->direction = 1;
    else if (ref < s->ref)
        s->direction = -1;
    s->ref = ref;
    return ref;
}

struct shaper {
    double x1, x2, ref, speed, acceleration;
};

static double shape(double a, double w, struct shaper *s, double target)
{
    s->x1 += a * (target - s->x1);
    s->x2 += a * (s->x1 - s->x2);
    s->ref += a * (s->x2 - s->ref);
    s->speed = w * (s->x2 - s->ref);
    s->acceleration = w * (w * (s->x1 - s->x2) - s->speed);
    return s->ref;
}

static void stand(struct shaper *s, double position)
{
    s->x1 = s->x2 = s->ref = position;
    s->speed = s->acceleration = 0.0;
}

struct derivative { /* of a position or an error, filtered */
    double x, v;
    int primed;
};

static double differentiate(double a, double dt, struct derivative *s, double x)
{
    if (!s->primed) {
        s->x = x;
        s->primed = 1;
    }
    s->v += a * ((x - s->x) / dt - s->v);
    s->x = x;
    return s->v;
}

struct direction {
    double ref, sign;
    int primed;
};

static double friction_volts(double volts, struct direction *s, double ref)
{
    if (!s->primed) {
        s->ref = ref;
        s->primed = 1;
    }
    if (ref > s->ref)
        s->sign = 1.0;
    else if (ref < s->ref)
        s->sign = -1.0;
    s->ref = ref;
    return volts * s->sign;
}

struct limit {
    double u;
    int64_t saturated, n_saturated, n_nan;
};

static double limit(double low, double high, double most, struct limit *s, double u)
{
    double wanted = u;
    if (u != u) {
        s->n_nan++;
        u = 0.0;
    }
    u = clamp(u, s->u - most, s->u + most);
    s->u = clamp(u, low, high);
    s->saturated = s->u != wanted;
    s->n_saturated += s->saturated;
    return s->u;
}

static double fading(double decay, double *offset, double u, int changed, double u_before)
{
    if (changed)
        *offset = u_before - u;
    else
        *offset *= decay;
    return u + *offset;
}

/* ---- board and encoders ---- */

#define COUNTER_SIZE (1 << 24)
#define INITIAL_COUNT (COUNTER_SIZE / 2)

struct dac {
    int64_t codes;
    double before, after, age;
};

struct counter_reader {
    int64_t n, previous, position;
};

struct encoder {
    int64_t primed, index, lost;
    double room;
};

static int64_t to_codes(double x, int64_t code_min, int64_t code_max)
{
    return x != x ? 0 : (int64_t)clamp(rint(x), (double)code_min, (double)code_max);
}

static double settled_time(double delay, double settling, double age)
{
    double t = age - delay;
    if (t <= 0.0)
        return 0.0;
    return t < settling ? 0.5 * t * t / settling : t - 0.5 * settling;
}

static double dac_volts(double volts_per_code, double delay, double settling, struct dac *s, int64_t codes, double h)
{
    if (codes != s->codes) {
        s->before += (s->after - s->before) * clamp((s->age - delay) / settling, 0.0, 1.0);
        s->after = codes * volts_per_code;
        s->codes = codes;
        s->age = 0.0;
    }
    if (s->age >= delay + settling)
        return s->after;
    double share = (settled_time(delay, settling, s->age + h) - settled_time(delay, settling, s->age)) / h;
    s->age += h;
    return s->before + (s->after - s->before) * share;
}

static uint32_t counter_codes(int64_t n) { return (uint32_t)((INITIAL_COUNT + n) & (COUNTER_SIZE - 1)); }

static int64_t read_counter(struct counter_reader *s, uint32_t codes)
{
    int64_t previous = s->n ? s->previous : INITIAL_COUNT;
    s->position += (((int64_t)codes - previous + INITIAL_COUNT) & (COUNTER_SIZE - 1)) - INITIAL_COUNT;
    s->previous = codes;
    s->n++;
    return s->position;
}

/* Encoder and LS7084 in x4: floor of the angle in quarter lines, limited to the rate of the one-shot. */
static int64_t encode(double quarters_per_radian, double highest_rate, struct encoder *s, double theta, double h)
{
    double x = theta * quarters_per_radian;
    if (!(fabs(x) < 9e15))
        return 0;
    int64_t index = (int64_t)floor(x);
    if (!s->primed) {
        s->primed = 1;
        s->index = index;
        s->room = 1.0;
        return 0;
    }
    int64_t pulses = index - s->index, wanted = pulses < 0 ? -pulses : pulses;
    s->index = index;
    double room = s->room + highest_rate * h;
    int64_t fits = (int64_t)floor(room + 1e-9), passed = wanted < fits ? wanted : fits;
    s->room = lower(room - passed, 1.0);
    s->lost += wanted - passed;
    return pulses >= 0 ? passed : -passed;
}

/* ---- the linear machine: x+ = Phi x + Gamma u, dry friction by Gauss-Seidel ---- */

#define SWEEPS 3

struct linear {
    double h, Phi_T[NX][NX], Gamma_T[NU + NQ][NX];
    double u[NU], x[NX], qm[NQ], vm[NQ], v_before[NQ], f[NQ], dry[NQ], r[NQ];
};

static void midpoint(struct linear *m)
{
    for (int i = 0; i < NQ; i++) {
        double v = m->x[NQ + i];
        m->vm[i] = 1.5 * v - 0.5 * m->v_before[i];
        m->qm[i] = m->x[i] + 0.5 * m->h * (1.25 * v - 0.25 * m->v_before[i]);
        m->v_before[i] = v;
        m->f[i] = 0.0;
    }
}

static double dry_friction(double v, double v_free, double gain, double limit)
{
    double push = v_free - v;
    if (v == 0.0) {
        if (fabs(push) <= gain * limit)
            return -push / gain;
        return push > 0.0 ? -limit : limit;
    }
    double s = v > 0.0 ? 1.0 : -1.0;
    double change = push - s * gain * limit;
    if (s * (v + change) >= 0.0)
        return -s * limit;
    if (fabs(push) <= gain * limit)
        return -v_free / gain;
    return s * limit * (1.0 - 2.0 * (-v / change));
}

static inline void add_row(double *x, const double *row, double a)
{
    for (int i = 0; i < NX; i++)
        x[i] += row[i] * a;
}

static void advance(struct linear *m)
{
    double next[NX] = {0.0};
    for (int j = 0; j < NX; j++)
        add_row(next, m->Phi_T[j], m->x[j]);
    for (int j = 0; j < NU; j++)
        add_row(next, m->Gamma_T[j], m->u[j]);
    for (int j = 0; j < NQ; j++) {
        double force = m->f[j] + m->r[j];
        if (force != 0.0)
            add_row(next, m->Gamma_T[NU + j], force);
    }
    int dry_nodes = 0;
    for (int j = 0; j < NQ; j++)
        dry_nodes += m->dry[j] > 0.0;
    for (int sweep = 0; sweep < (dry_nodes > 1 ? SWEEPS : dry_nodes); sweep++) {
        for (int j = 0; j < NQ; j++) {
            if (m->dry[j] <= 0.0)
                continue;
            double gain = m->Gamma_T[NU + j][NQ + j];
            double r = dry_friction(m->x[NQ + j], next[NQ + j] - gain * m->r[j], gain, m->dry[j]);
            if (r != m->r[j]) {
                add_row(next, m->Gamma_T[NU + j], r - m->r[j]);
                m->r[j] = r;
            }
        }
    }
    memcpy(m->x, next, sizeof next);
}
