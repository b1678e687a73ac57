/* Linear Drive Unit in hand-written C: only the tick and the plant of configs/ldu.yaml. */

#define NQ 4
#define NU 1
#define NX 10
#include "reference.h"

enum { MOTOR, WHEEL, CAPSTAN, ENCODER };

/* Named as in rtctl: block_field, plant_block_field; filled in by name by the caller. */
#define REALS(X) \
    X(encoder_radians_per_count) X(scale_metres_per_count) X(machine_R_c) X(machine_amp_per_volt) X(shaper_a) \
    X(shaper_w) X(velocity_a) X(velocity_dt) X(position_gain) X(position_integral) X(position_velocity_gain) \
    X(position_tracking) X(bumpless_decay) X(friction_volts) X(limit_low) X(limit_high) X(limit_most) \
    X(amplifier_limit) X(output_volts_per_code) X(safety_frozen_effort) X(safety_following) X(safety_tension_min) \
    X(safety_tension_max) X(safety_current) X(safety_disagreement) X(safety_fade) X(reference_dt) X(excitation_amplitude) \
    X(plant_plant_h) X(plant_plant_R_c) X(plant_plant_F_c) X(plant_output_volts_per_code) X(plant_output_delay) \
    X(plant_output_settling) X(plant_encoder_quarters_per_radian) X(plant_encoder_highest_rate) \
    X(plant_scale_counts_per_metre)
#define WHOLES(X) \
    X(machine_line) X(machine_settle) X(safety_link) X(safety_frozen) X(safety_tension) X(safety_current_time) \
    X(safety_missed) X(output_code_min) X(output_code_max) X(reference_n) X(excitation_n) X(excitation_start) \
    X(excitation_stop)

struct parameters {
    REALS(FIELD_REAL)
    WHOLES(FIELD_WHOLE)
};
const char reals[] = REALS(NAME);
const char wholes[] = WHOLES(NAME);

struct row {
    int64_t tick;
    double t, period, lateness, state, trip, link_age, order, watchdog, target, ref, w, u, encoder_counts, scale_counts, position,
        scale, position_error, speed, u_c, truth_x, truth_speed, truth_current;
};

static struct parameters p;
static struct safety_limits safety_limits;
static const double *table_t, *table_r, *waveform;
static struct row *rows;
static int64_t n_rows;
static _Atomic int64_t head;
static struct mailbox box;
static struct command command;

static struct {
    struct safety safety;
    struct counter_reader encoder, scale;
    struct reference reference;
    struct shaper shaper;
    struct derivative speed;
    struct direction friction;
    struct limit limit;
    double integral, offset, u_fb;
    int64_t k_run, gains, play;
    struct row row;
} loop;

static struct {
    struct linear m;
    struct dac dac;
    struct encoder encoder;
    int64_t counter0, counter1, scale_index, scale_primed;
} plant;

struct outputs {
    int32_t codes;
    uint32_t lines;
};

static struct {
    uint32_t counters[2];
    double truth[3];
} in;
static struct outputs out, held;

static void switch_on(double x)
{
    loop.reference.ref = x;
    loop.reference.mode = HOLD;
    stand(&loop.shaper, x);
    loop.speed.v = loop.friction.sign = loop.offset = loop.u_fb = loop.integral = 0.0;
    loop.speed.primed = loop.friction.primed = 0;
    loop.limit.u = clamp(0.0, p.limit_low, p.limit_high);
}

static void tick(int64_t k)
{
    struct row *y = &loop.row;
    struct safety *safety = &loop.safety;

    /* sensors */
    int64_t counts = read_counter(&loop.encoder, in.counters[0]);
    y->encoder_counts = counts;
    y->scale_counts = read_counter(&loop.scale, in.counters[1]);
    y->scale = y->scale_counts * p.scale_metres_per_count;
    y->position = p.machine_R_c * (counts * p.encoder_radians_per_count);
    if (timing.on)
        timing.read = now();

    /* state */
    obey(safety, &command);
    check_timing(&safety_limits, safety, &command, 1, 0, k);
    if (safety->on)
        switch_on(y->position);
    if (safety->state == ARMED && safety->armed_for > p.machine_settle) {
        safety->state = RUNNING;
        loop.k_run = k;
    }

    /* reference */
    int running = safety->state == RUNNING;
    if (running && command.play != loop.play) {
        loop.play = command.play;
        loop.reference.mode = PLAY;
        loop.reference.k0 = k;
        loop.reference.i = 0;
        loop.reference.origin = loop.reference.ref;
    }
    y->target = follow_reference(table_t, table_r, p.reference_n, p.reference_dt, &loop.reference, &command, k);
    y->ref = shape(p.shaper_a, p.shaper_w, &loop.shaper, y->target);
    int64_t since = k - loop.k_run;
    y->w = running && since >= p.excitation_start && since < p.excitation_stop
               ? p.excitation_amplitude * waveform[(since - p.excitation_start) % p.excitation_n]
               : 0.0;

    /* law */
    y->position_error = y->ref - y->position;
    y->speed = differentiate(p.velocity_a, p.velocity_dt, &loop.speed, y->position);
    loop.integral += p.position_integral * y->position_error;
    double u_fb = p.position_gain * y->position_error + loop.integral - p.position_velocity_gain * y->speed;
    loop.u_fb = fading(p.bumpless_decay, &loop.offset, u_fb, command.gains != loop.gains, loop.u_fb);
    loop.gains = command.gains;
    y->u_c = loop.u_fb + friction_volts(p.friction_volts, &loop.friction, y->ref) + y->w;
    double u = limit(p.limit_low, p.limit_high, p.limit_most, &loop.limit, y->u_c);
    loop.integral += p.position_tracking * (u - y->u_c);

    /* safety */
    check_motion(&safety_limits, safety, y->position_error, counts, u, fabs(u) * p.machine_amp_per_volt, k);
    check_sensors(&safety_limits, safety, p.machine_R_c * (counts * p.encoder_radians_per_count) - y->scale, k);
    fade(&safety_limits, safety);
    if (timing.on)
        timing.law = now();

    /* outputs */
    u = gate(safety, u, 0);
    uint32_t forward = u < 0.0 ? 0 : 1;
    double volts = u != u ? 0.0 : lower(fabs(u), p.amplifier_limit);
    out.codes = to_codes(volts / p.output_volts_per_code, p.output_code_min, p.output_code_max);
    out.lines = forward << p.machine_line;
    y->u = (forward ? 1.0 : -1.0) * (out.codes * p.output_volts_per_code);
    y->state = safety->state;
    y->trip = safety->trip;
    y->link_age = safety->silent;
    y->order = command.order;
    y->watchdog = 0;
    y->truth_x = in.truth[0];
    y->truth_speed = in.truth[1];
    y->truth_current = in.truth[2];
}

static void substep(void)
{
    double h = p.plant_plant_h;
    double volts = dac_volts(p.plant_output_volts_per_code, p.plant_output_delay, p.plant_output_settling, &plant.dac,
                             held.codes, h);
    double amperes = 0.1 * higher(volts, 0.0);
    plant.m.u[0] = held.lines >> p.machine_line & 1 ? amperes : -amperes;
    midpoint(&plant.m);
    advance(&plant.m);
    plant.counter0 += encode(p.plant_encoder_quarters_per_radian, p.plant_encoder_highest_rate, &plant.encoder,
                             plant.m.x[ENCODER], h);
    double x = p.plant_plant_R_c * plant.m.x[CAPSTAN] * p.plant_scale_counts_per_metre;
    if (fabs(x) < 9e15) {
        int64_t index = (int64_t)floor(x);
        if (plant.scale_primed)
            plant.counter1 += index - plant.scale_index;
        plant.scale_primed = 1;
        plant.scale_index = index;
    }
}

static void sample(void)
{
    in.counters[0] = counter_codes(plant.counter0);
    in.counters[1] = counter_codes(plant.counter1);
    in.truth[0] = p.plant_plant_R_c * plant.m.x[CAPSTAN];
    in.truth[1] = p.plant_plant_R_c * plant.m.x[NQ + CAPSTAN];
    in.truth[2] = plant.m.x[2 * NQ];
}

void prepare(const struct parameters *given, const double *Phi_T, const double *Gamma_T, const double *t,
             const double *r, const double *wave, void *ring, int64_t ring_rows)
{
    p = *given;
    memset(&loop, 0, sizeof loop);
    memset(&plant, 0, sizeof plant);
    memset(&in, 0, sizeof in);
    memset(&command, 0, sizeof command);
    memset(&out, 0, sizeof out);
    memset(&held, 0, sizeof held);
    box = (struct mailbox){.count = 2, .command = {.arm = 1, .play = 1, .order = 1}};
    safety_limits = (struct safety_limits){
        p.safety_link, p.safety_frozen, p.safety_tension, p.safety_current_time, p.safety_missed,
        p.safety_frozen_effort, p.safety_following, p.safety_tension_min, p.safety_tension_max, p.safety_current,
        p.safety_disagreement, p.safety_fade};
    table_t = t;
    table_r = r;
    waveform = wave;
    rows = ring;
    n_rows = ring_rows;
    head = 0;
    plant.m.h = p.plant_plant_h;
    plant.m.dry[CAPSTAN] = p.plant_plant_R_c * p.plant_plant_F_c;
    memcpy(plant.m.Phi_T, Phi_T, sizeof plant.m.Phi_T);
    memcpy(plant.m.Gamma_T, Gamma_T, sizeof plant.m.Gamma_T);
    sample();
}

/* `ahead` is 1 where outputs leave at the start of the next tick. The matrices never change here: returns 0. */
int64_t run(int64_t ticks, int64_t substeps, double dt, int64_t ahead)
{
    for (int64_t k = 0; k < ticks; k++) {
        take(&box, &command);
        if (ahead)
            held = out;
        int64_t was = loop.safety.state;
        loop.row.tick = k;
        loop.row.t = k * dt;
        loop.row.period = dt;
        loop.row.lateness = 0.0;
        timing.on = k % 16 == 0;
        timing.begun = timing.on ? now() : 0;
        tick(k);
        int64_t wrote = timing.on ? now() : 0;
        if (!ahead || (loop.safety.state != was && (was == ARMED || was == RUNNING)))
            held = out;
        int64_t n = atomic_load_explicit(&head, memory_order_relaxed);
        rows[n % n_rows] = loop.row;
        atomic_store_explicit(&head, n + 1, memory_order_release);
        if (timing.on)
            count_stages(wrote);
        for (int64_t i = 0; i < substeps; i++)
            substep();
        sample();
    }
    return 0;
}
