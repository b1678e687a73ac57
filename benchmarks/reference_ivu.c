/* Image Verification Unit in hand-written C: only the tick and the plant of configs/ivu.yaml. */

#define NQ 5
#define NU 2
#define NX 14
#include "reference.h"

enum { MOTOR1, REEL1, CAPSTAN, REEL2, MOTOR2 };

/* Named as in rtctl: block_field, plant_block_field; filled in by name by the caller. */
#define REALS(X) \
    X(capstan_radians_per_count) X(input1_volts_per_code) X(input2_volts_per_code) X(reel1_low) X(reel1_high) \
    X(reel2_low) X(reel2_high) X(machine_R1) X(machine_R2) X(machine_grow) X(machine_core) \
    X(machine_trail_speed) \
    X(machine_hand_over) X(machine_R_c) X(machine_fast) X(reel1_radians_per_count) X(reel2_radians_per_count) X(velocity_a) X(velocity_dt) X(reference_speed_a) X(reference_speed_dt) \
    X(tension_estimate_torque_per_volt) X(tension_estimate_J) X(tension_estimate_tau_F) X(tension_estimate_R_c) \
    X(tension_estimate_v_min) X(tension_estimate_a) X(shaper_a) X(shaper_w) X(position_gain) X(position_D) X(position_a) \
    X(position_dt) X(bumpless_decay) X(friction1_volts) X(friction2_volts) X(inertia_volts) X(tension_F_t) \
    X(tension_torque_per_volt) X(tension_ramp) X(limit_low) X(limit_high) X(limit_most) X(drive_amp_per_volt) \
    X(output1_volts_per_code) X(output2_volts_per_code) X(safety_frozen_effort) X(safety_following) \
    X(safety_tension_min) X(safety_tension_max) X(safety_current) X(safety_disagreement) X(safety_fade) X(reference_dt) \
    X(excitation_amplitude) \
    X(plant_plant_h) X(plant_plant_R1) X(plant_plant_R2) X(plant_plant_R_c) X(plant_plant_R_min) \
    X(plant_plant_J_1) X(plant_plant_J_2) X(plant_plant_c1) X(plant_plant_c2) X(plant_plant_k1) X(plant_plant_k2) \
    X(plant_plant_c_m1) X(plant_plant_c_m2) X(plant_plant_k_m1) X(plant_plant_k_m2) X(plant_plant_rho_h) \
    X(plant_plant_d_tape) X(plant_plant_tau_F1) X(plant_plant_tau_F2) X(plant_plant_tau_Fc) \
    X(plant_driver_volts_max) X(plant_output1_volts_per_code) X(plant_output1_delay) X(plant_output1_settling) \
    X(plant_output2_volts_per_code) X(plant_output2_delay) X(plant_output2_settling) \
    X(plant_capstan_quarters_per_radian) X(plant_capstan_highest_rate) X(plant_reel1_periods_per_radian) \
    X(plant_reel1_phase) X(plant_reel1_flank) X(plant_reel2_periods_per_radian) X(plant_reel2_phase) \
    X(plant_reel2_flank) X(plant_input1_volts_per_code) X(plant_input1_scan_delay) X(plant_input2_volts_per_code) \
    X(plant_input2_scan_delay)
#define WHOLES(X) \
    X(machine_settle) X(safety_link) X(safety_frozen) X(safety_tension) X(safety_current_time) X(safety_missed) \
    X(output1_code_min) X(output1_code_max) X(output2_code_min) X(output2_code_max) X(plant_input1_code_min) \
    X(plant_input1_code_max) X(plant_input2_code_min) X(plant_input2_code_max) X(reference_n) X(excitation_n) \
    X(excitation_start) X(excitation_stop)

struct parameters {
    REALS(FIELD_REAL)
    WHOLES(FIELD_WHOLE)
};
const char reals[] = REALS(NAME);
const char wholes[] = WHOLES(NAME);

struct row {
    int64_t tick;
    double t, period, lateness, state, trip, link_age, order, watchdog, target, ref, w, u1, u2, capstan_counts,
        reel1_counts, reel2_counts, capstan, capstan_error, capstan_speed, u_c, R1, R2, gain_factor, tension1_estimate,
        tension2_estimate, truth_tension1, truth_tension2, truth_capstan, truth_motor1, truth_motor2, truth_R1,
        truth_R2;
};

struct inputs {
    uint32_t counter;
    int32_t ai[2];
    double truth[7];
};

struct optical {
    int primed, high;
    int64_t counts;
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
    struct counter_reader capstan;
    struct optical reel1, reel2;
    struct reference reference;
    struct shaper shaper;
    struct derivative speed, acceleration, reference_speed, error;
    struct direction friction1, friction2;
    struct limit limit1, limit2;
    double R1_0, R2_0, phi_0, R1, R2, tension_share, offset, u_fb;
    double phi_1;
    int64_t k_run, gains, play, direction, n1, n2;
    struct row row;
} loop;

static struct {
    struct linear m;
    struct dac dac1, dac2;
    struct encoder encoder;
    int64_t counter;
    double R1, R2, J1, J2, T1, T2;
    int64_t relinearised; /* number of required updates of the matrices: must stay 0 here */
} plant;

static struct inputs in;
static int64_t codes[2], held[2];

static int64_t count_edges(double low, double high, struct optical *s, double volts)
{
    if (!s->primed) {
        s->primed = 1;
        s->high = volts > high;
    } else if (!s->high && volts > high) {
        s->high = 1;
        s->counts++;
    } else if (volts < low) {
        s->high = 0;
    }
    return s->counts;
}

static void switch_on(double phi)
{
    loop.reference.ref = phi;
    loop.reference.mode = HOLD;
    stand(&loop.shaper, phi);
    loop.error.v = loop.speed.v = loop.acceleration.v = loop.reference_speed.v = 0.0;
    loop.error.primed = loop.speed.primed = loop.acceleration.primed = loop.reference_speed.primed = 0;
    loop.friction1.sign = loop.friction2.sign = 0.0;
    loop.friction1.primed = loop.friction2.primed = 0;
    loop.tension_share = loop.offset = 0.0;
    loop.limit1.u = loop.limit2.u = clamp(0.0, p.limit_low, p.limit_high);
    loop.R1_0 = p.machine_R1;
    loop.R2_0 = p.machine_R2;
    loop.phi_0 = phi;
}

static double grown(double R_0, double area)
{
    double least = R_0 > 0.0 ? lower(p.machine_core, R_0) : p.machine_core;
    return sqrt(higher(R_0 * R_0 + area, least * least));
}

static double tape_apart(double phi, double speed, int64_t n1, int64_t n2, double R1, double R2)
{
    double tape = fabs(phi - loop.phi_1) * p.machine_R_c;
    int direction = speed > 0.3 ? 1 : speed < -0.3 ? -1 : 0;
    int blind = fabs(speed) * p.machine_R_c > p.machine_fast * lower(R1, R2);
    if (!direction || direction != loop.direction || blind || tape > 0.05 || loop.safety.state != RUNNING) {
        loop.direction = direction;
        loop.phi_1 = phi;
        loop.n1 = n1;
        loop.n2 = n2;
        return 0.0;
    }
    double apart1 = (n1 - loop.n1) * p.reel1_radians_per_count * R1 - tape;
    double apart2 = (n2 - loop.n2) * p.reel2_radians_per_count * R2 - tape;
    return lower(fabs(apart1 + apart2), higher(fabs(apart1), fabs(apart2)));
}

static void tick(int64_t k)
{
    struct row *y = &loop.row;
    struct safety *safety = &loop.safety;

    /* sensors */
    int64_t counts = read_counter(&loop.capstan, in.counter);
    y->capstan_counts = counts;
    y->capstan = counts * p.capstan_radians_per_count;
    y->reel1_counts = count_edges(p.reel1_low, p.reel1_high, &loop.reel1, in.ai[0] * p.input1_volts_per_code);
    y->reel2_counts = count_edges(p.reel2_low, p.reel2_high, &loop.reel2, in.ai[1] * p.input2_volts_per_code);
    if (timing.on)
        timing.read = now();

    /* state */
    obey(safety, &command);
    check_timing(&safety_limits, safety, &command, 1, 0, k);
    if (safety->on)
        switch_on(y->capstan);
    if (safety->state == ARMED && safety->armed_for > p.machine_settle) {
        safety->state = RUNNING;
        loop.k_run = k;
    }

    /* estimates */
    double moved = p.machine_grow * (y->capstan - loop.phi_0);
    y->R1 = grown(loop.R1_0, moved);
    y->R2 = grown(loop.R2_0, -moved);
    y->capstan_speed = differentiate(p.velocity_a, p.velocity_dt, &loop.speed, y->capstan);
    double a = differentiate(p.velocity_a, p.velocity_dt, &loop.acceleration, y->capstan_speed);
    double moving = clamp(y->capstan_speed / p.tension_estimate_v_min, -1.0, 1.0);
    double turn1 = p.tension_estimate_J * a * p.tension_estimate_R_c / y->R1;
    double turn2 = p.tension_estimate_J * a * p.tension_estimate_R_c / y->R2;
    double torque = p.tension_estimate_torque_per_volt;
    double T1_now = (torque * y->u1 - p.tension_estimate_tau_F * moving - turn1) / y->R1;
    double T2_now = (torque * y->u2 + p.tension_estimate_tau_F * moving + turn2) / y->R2;
    y->tension1_estimate += p.tension_estimate_a * (T1_now - y->tension1_estimate);
    y->tension2_estimate += p.tension_estimate_a * (T2_now - y->tension2_estimate);

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
    double speed = differentiate(p.reference_speed_a, p.reference_speed_dt, &loop.reference_speed, y->ref);
    int64_t since = k - loop.k_run;
    y->w = running && since >= p.excitation_start && since < p.excitation_stop
               ? p.excitation_amplitude * waveform[(since - p.excitation_start) % p.excitation_n]
               : 0.0;

    /* law */
    y->capstan_error = y->ref - y->capstan;
    double d = differentiate(p.position_a, p.position_dt, &loop.error, y->capstan_error);
    double u_pd = p.position_gain * y->capstan_error + p.position_D * d;
    y->gain_factor = 1.0;
    loop.u_fb = fading(p.bumpless_decay, &loop.offset, y->gain_factor * u_pd, command.gains != loop.gains, loop.u_fb);
    loop.gains = command.gains;
    double u_f1 = friction_volts(p.friction1_volts, &loop.friction1, y->ref);
    double u_f2 = friction_volts(p.friction2_volts, &loop.friction2, y->ref);
    double trail = lower(fabs(speed) / p.machine_trail_speed, 1.0);
    double rest = p.machine_hand_over * (1.0 - trail);
    int forward = loop.friction1.sign > 0.0;
    double friction = forward ? u_f1 + rest * u_f2 * y->R1 / y->R2 : u_f2 + rest * u_f1 * y->R2 / y->R1;
    y->u_c = loop.u_fb + y->w + friction;
    loop.tension_share = lower(loop.tension_share + p.tension_ramp, 1.0);
    double V1 = loop.tension_share * p.tension_F_t * y->R1 / p.tension_torque_per_volt;
    double V2 = loop.tension_share * p.tension_F_t * y->R2 / p.tension_torque_per_volt;
    double T1 = V1 + p.inertia_volts * loop.shaper.acceleration / y->R1 + (forward ? 0.0 : trail * u_f1);
    double T2 = V2 + -p.inertia_volts * loop.shaper.acceleration / y->R2 - (forward ? trail * u_f2 : 0.0);
    double u1 = T1 + higher(y->u_c, 0.0);
    double u2 = T2 + higher(-y->u_c, 0.0);
    u1 = limit(p.limit_low, p.limit_high, p.limit_most, &loop.limit1, u1);
    u2 = limit(p.limit_low, p.limit_high, p.limit_most, &loop.limit2, u2);

    /* safety */
    double amperes = higher(fabs(u1), fabs(u2)) * p.drive_amp_per_volt;
    check_motion(&safety_limits, safety, y->capstan_error, counts, y->u_c, amperes, k);
    double apart = tape_apart(y->capstan, y->capstan_speed, y->reel1_counts, y->reel2_counts, y->R1, y->R2);
    check_sensors(&safety_limits, safety, apart, k);
    int out = lower(y->tension1_estimate, y->tension2_estimate) < p.safety_tension_min ||
              higher(y->tension1_estimate, y->tension2_estimate) > p.safety_tension_max;
    safety->slack = out && safety->state == RUNNING ? safety->slack + 1 : 0;
    if (safety->slack > p.safety_tension)
        trip(safety, TENSION, k);
    fade(&safety_limits, safety);
    if (timing.on)
        timing.law = now();

    /* outputs */
    codes[0] = to_codes(gate(safety, u1, 0) / p.output1_volts_per_code, p.output1_code_min, p.output1_code_max);
    codes[1] = to_codes(gate(safety, u2, 1) / p.output2_volts_per_code, p.output2_code_min, p.output2_code_max);
    y->u1 = codes[0] * p.output1_volts_per_code;
    y->u2 = codes[1] * p.output2_volts_per_code;
    y->state = safety->state;
    y->trip = safety->trip;
    y->link_age = safety->silent;
    y->order = command.order;
    y->watchdog = 0;
    y->truth_tension1 = in.truth[0];
    y->truth_tension2 = in.truth[1];
    y->truth_capstan = in.truth[2];
    y->truth_motor1 = in.truth[3];
    y->truth_motor2 = in.truth[4];
    y->truth_R1 = in.truth[5];
    y->truth_R2 = in.truth[6];
}

static double fourth(double R) { return (R * R) * (R * R); }

static double wound(double q, double R, double grow)
{
    if (R + grow * q >= p.plant_plant_R_min)
        return (R + 0.5 * grow * q) * q;
    double q_end = (p.plant_plant_R_min - R) / grow;
    return (R + 0.5 * grow * q_end) * q_end + p.plant_plant_R_min * (q - q_end);
}

static void follow_tape(void)
{
    struct linear *m = &plant.m;
    double R1_lin = p.plant_plant_R1, R2_lin = p.plant_plant_R2, J1_lin = p.plant_plant_J_1, J2_lin = p.plant_plant_J_2;
    double grow = p.plant_plant_d_tape / (2.0 * M_PI);
    double q1 = m->qm[REEL1], q2 = m->qm[REEL2], v1 = m->vm[REEL1], v2 = m->vm[REEL2];
    plant.R1 = higher(R1_lin + grow * q1, p.plant_plant_R_min);
    plant.R2 = higher(R2_lin + grow * q2, p.plant_plant_R_min);
    plant.J1 = J1_lin + 0.5 * M_PI * p.plant_plant_rho_h * (fourth(plant.R1) - fourth(R1_lin));
    plant.J2 = J2_lin + 0.5 * M_PI * p.plant_plant_rho_h * (fourth(plant.R2) - fourth(R2_lin));
    if (fabs(plant.R1 - R1_lin) > 5e-3 * R1_lin || fabs(plant.R2 - R2_lin) > 5e-3 * R2_lin)
        plant.relinearised++;
    double l1 = wound(q1, R1_lin, grow), l2 = wound(q2, R2_lin, grow);
    double x = p.plant_plant_R_c * m->qm[CAPSTAN], dx = p.plant_plant_R_c * m->vm[CAPSTAN];
    double c1 = p.plant_plant_c1, c2 = p.plant_plant_c2, k1 = p.plant_plant_k1, k2 = p.plant_plant_k2;
    double F1_lin = c1 * (x - R1_lin * q1) + k1 * (dx - R1_lin * v1);
    double F2_lin = c2 * (-x - R2_lin * q2) + k2 * (-dx - R2_lin * v2);
    double F1 = c1 * (x - l1) + k1 * (dx - plant.R1 * v1);
    double F2 = c2 * (-x - l2) + k2 * (-dx - plant.R2 * v2);
    double e1 = l1 - R1_lin * q1, e2 = l2 - R2_lin * q2, R_c = p.plant_plant_R_c; /* summed as linear.tension sums */
    plant.T1 = c1 * (R1_lin * q1 + -R_c * m->qm[CAPSTAN] + e1) + k1 * (R1_lin * v1 + -R_c * m->vm[CAPSTAN]) +
               (F1_lin - F1 - c1 * e1);
    plant.T2 = c2 * (R2_lin * q2 + R_c * m->qm[CAPSTAN] + e2) + k2 * (R2_lin * v2 + R_c * m->vm[CAPSTAN]) +
               (F2_lin - F2 - c2 * e2);
    double tau1 = p.plant_plant_c_m1 * (m->qm[MOTOR1] - q1) + p.plant_plant_k_m1 * (m->vm[MOTOR1] - v1);
    double tau2 = p.plant_plant_c_m2 * (m->qm[MOTOR2] - q2) + p.plant_plant_k_m2 * (m->vm[MOTOR2] - v2);
    m->f[REEL1] += (F1 * plant.R1 + tau1) * (J1_lin / plant.J1) - (F1_lin * R1_lin + tau1);
    m->f[REEL2] += (F2 * plant.R2 + tau2) * (J2_lin / plant.J2) - (F2_lin * R2_lin + tau2);
    m->f[CAPSTAN] += R_c * (F1_lin - F1); /* tape by tape, as the joints of a machine are summed */
    m->f[CAPSTAN] += R_c * (F2 - F2_lin);
}

static void substep(void)
{
    double h = p.plant_plant_h, most = p.plant_driver_volts_max;
    double u1 = dac_volts(p.plant_output1_volts_per_code, p.plant_output1_delay, p.plant_output1_settling,
                          &plant.dac1, held[0], h);
    double u2 = dac_volts(p.plant_output2_volts_per_code, p.plant_output2_delay, p.plant_output2_settling,
                          &plant.dac2, held[1], h);
    plant.m.u[0] = u1 != u1 ? 0.0 : clamp(u1, -most, most);
    plant.m.u[1] = u2 != u2 ? 0.0 : clamp(u2, -most, most);
    midpoint(&plant.m);
    follow_tape();
    advance(&plant.m);
    plant.counter += encode(p.plant_capstan_quarters_per_radian, p.plant_capstan_highest_rate, &plant.encoder,
                            plant.m.x[CAPSTAN], h);
}

static double optical_volts(double periods_per_radian, double phase, double flank, double theta)
{
    double u = theta * periods_per_radian + phase;
    u -= floor(u);
    return 5.0 * clamp(0.5 + (0.25 - fabs(u - 0.5)) / flank, 0.0, 1.0);
}

static void sample(void)
{
    const double *x = plant.m.x;
    in.counter = counter_codes(plant.counter);
    double theta1 = x[REEL1] + x[NQ + REEL1] * p.plant_input1_scan_delay;
    double theta2 = x[REEL2] + x[NQ + REEL2] * p.plant_input2_scan_delay;
    double v1 = optical_volts(p.plant_reel1_periods_per_radian, p.plant_reel1_phase, p.plant_reel1_flank, theta1);
    double v2 = optical_volts(p.plant_reel2_periods_per_radian, p.plant_reel2_phase, p.plant_reel2_flank, theta2);
    in.ai[0] = to_codes(v1 / p.plant_input1_volts_per_code, p.plant_input1_code_min, p.plant_input1_code_max);
    in.ai[1] = to_codes(v2 / p.plant_input2_volts_per_code, p.plant_input2_code_min, p.plant_input2_code_max);
    in.truth[0] = plant.T1;
    in.truth[1] = plant.T2;
    in.truth[2] = x[CAPSTAN];
    in.truth[3] = x[MOTOR1];
    in.truth[4] = x[MOTOR2];
    in.truth[5] = plant.R1;
    in.truth[6] = plant.R2;
}

void prepare(const struct parameters *given, const double *Phi_T, const double *Gamma_T, const double *t,
             const double *r, const double *wave, void *ring, int64_t ring_rows)
{
    p = *given;
    memset(&loop, 0, sizeof loop);
    memset(&plant, 0, sizeof plant);
    memset(&in, 0, sizeof in);
    memset(&command, 0, sizeof command);
    memset(codes, 0, sizeof codes);
    memset(held, 0, sizeof held);
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
    plant.R1 = p.plant_plant_R1;
    plant.R2 = p.plant_plant_R2;
    plant.m.h = p.plant_plant_h;
    plant.m.dry[MOTOR1] = p.plant_plant_tau_F1;
    plant.m.dry[MOTOR2] = p.plant_plant_tau_F2;
    plant.m.dry[CAPSTAN] = p.plant_plant_tau_Fc;
    memcpy(plant.m.Phi_T, Phi_T, sizeof plant.m.Phi_T);
    memcpy(plant.m.Gamma_T, Gamma_T, sizeof plant.m.Gamma_T);
    sample();
}

/* `ahead` is 1 where outputs leave at the start of the next tick. Returns how often the matrices were outdated. */
int64_t run(int64_t ticks, int64_t substeps, double dt, int64_t ahead)
{
    for (int64_t k = 0; k < ticks; k++) {
        take(&box, &command);
        if (ahead)
            memcpy(held, codes, sizeof held);
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
            memcpy(held, codes, sizeof held);
        int64_t n = atomic_load_explicit(&head, memory_order_relaxed);
        rows[n % n_rows] = loop.row;
        atomic_store_explicit(&head, n + 1, memory_order_release);
        if (timing.on)
            count_stages(wrote);
        for (int64_t i = 0; i < substeps; i++)
            substep();
        sample();
    }
    return plant.relinearised;
}
