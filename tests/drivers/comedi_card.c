/* A card behind libcomedi's C signatures, for tests: what comedilib.h declares, with wires that a test holds.
 *
 * /dev/comedi0 is an at-mio-16de-10 by ni_atmio: 12 bits, 24-bit counters, no decoders. /dev/comedi4 has 16 bits,
 * 32-bit counters and decoders (M series). The others do not open, each for a reason of its own.
 */
#include <errno.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef unsigned int lsampl_t;
typedef struct { double min, max; unsigned int unit; } comedi_range;
typedef struct {
    const char *driver, *board;
    lsampl_t bits, counter_bits;
    int decoders, is_open, locked;
    double in[16];
    lsampl_t out[2];
    int out_range[2];
    unsigned int lines, outputs;
    struct { lsampl_t count; int armed, mode, clock, a, b; } counter[2];
} comedi_t;

enum { AI, AO, DIO, PORTS, UNUSED, GPCT0 = 11, GPCT1, FREQUENCY, SUBDEVICES };
enum { TYPE_AI = 1, TYPE_AO = 2, TYPE_DIO = 5, TYPE_COUNTER = 6 };

static comedi_range ai_ranges[] = {
    {-10, 10, 0}, {-5, 5, 0}, {-2.5, 2.5, 0}, {-1, 1, 0}, {-0.5, 0.5, 0}, {-0.25, 0.25, 0}, {-0.1, 0.1, 0},
    {-0.05, 0.05, 0}, {0, 20, 0}, {0, 10, 0}, {0, 5, 0}, {0, 2, 0}, {0, 1, 0}, {0, 0.5, 0}, {0, 0.2, 0}, {0, 0.1, 0}};
static comedi_range ao_ranges[] = {{-10, 10, 0}, {0, 10, 0}, {-1, 1, 256}, {0, 1, 256}};
static comedi_t cards[2] = {
    {.driver = "ni_atmio", .board = "at-mio-16de-10", .bits = 0xfff, .counter_bits = 0xffffff},
    {.driver = "ni_pcimio", .board = "pci-6221", .bits = 0xffff, .counter_bits = 0xffffffff, .decoders = 1}};
static int last_error, failing_kind = -1, failing_channel;

/* what a test does to the wires; card 0 or 1 */
void wire_reset(int card) {
    comedi_t *c = &cards[card];
    memset(c->in, 0, sizeof c->in);
    memset(c->counter, 0, sizeof c->counter);
    c->out[0] = c->out[1] = 12345;
    c->lines = 0xff, c->outputs = 0, c->is_open = 0, c->locked = 0;
    failing_kind = -1;
}
void wire_input(int card, int channel, double volts) { cards[card].in[channel] = volts; }
void wire_fail(int kind, int channel) { failing_kind = kind, failing_channel = channel; }
void wire_lock(int card) { cards[card].locked = 1; }
void wire_break_open(int card) { cards[card].is_open = 0; }
int wire_open(int card) { return cards[card].is_open; }
lsampl_t wire_raw(int card, int channel) { return cards[card].out[channel]; }
unsigned int wire_lines(int card) { return cards[card].lines; }
unsigned int wire_outputs(int card) { return cards[card].outputs; }
double wire_output(int card, int channel) {
    comedi_t *c = &cards[card];
    comedi_range *r = &ao_ranges[c->out_range[channel]];
    return r->min + (r->max - r->min) * c->out[channel] / (c->bits + 1.0);
}
/* edges at the encoder: a DAQ-STC counts them only when armed, on its PFI, with the direction line as input */
void wire_pulses(int card, int n, int pulses) {
    comedi_t *c = &cards[card];
    int quadrature = c->counter[n].mode & (7 << 16), hardware = c->counter[n].mode & (2 << 24);
    int wired = quadrature ? c->decoders && c->counter[n].a == (n ? 4 : 9) && c->counter[n].b == (n ? 0x16 : 0x15)
                           : c->counter[n].clock == (n ? 0x23 : 0x28) && !(c->outputs >> (6 + n) & 1);
    if (c->counter[n].armed && hardware && wired)
        c->counter[n].count = (c->counter[n].count + pulses) & c->counter_bits;
}

static int refuse(int code) { last_error = code; return -1; }
static int fails(int kind, unsigned int channel) {
    return failing_kind == kind && (int)channel == failing_channel ? refuse(EIO) : 0;
}

comedi_t *comedi_open(const char *name) {
    static const char *const names[] = {"/dev/comedi0", "/dev/comedi4"};
    for (int n = 0; n < 2; n++)
        if (!strcmp(name, names[n])) { cards[n].is_open = 1; return &cards[n]; }
    last_error = !strcmp(name, "/dev/comedi2") ? EACCES : !strcmp(name, "/dev/comedi3") ? ENODEV
               : !strcmp(name, "/dev/comedi5") ? EBUSY : ENOENT;
    return NULL;
}
int comedi_close(comedi_t *c) { c->is_open = 0; return 0; }
int comedi_errno(void) { return last_error; }
char *comedi_strerror(int code) { return strerror(code); }
char *comedi_get_driver_name(comedi_t *c) { return (char *)c->driver; }
char *comedi_get_board_name(comedi_t *c) { return (char *)c->board; }

static int type_of(unsigned int s) {
    return s == AI ? TYPE_AI : s == AO ? TYPE_AO : s == DIO || s == PORTS ? TYPE_DIO
         : s == GPCT0 || s == GPCT1 || s == FREQUENCY ? TYPE_COUNTER : 0;
}
int comedi_find_subdevice_by_type(comedi_t *c, int type, unsigned int from) {
    (void)c;
    for (unsigned int s = from; s < SUBDEVICES; s++)
        if (type_of(s) == type) return (int)s;
    return -1;
}
int comedi_get_n_channels(comedi_t *c, unsigned int s) {
    (void)c;
    return s == AI ? 16 : s == AO ? 2 : s == DIO ? 8 : s == PORTS ? 24 : type_of(s) == TYPE_COUNTER ? 3 : 0;
}
lsampl_t comedi_get_maxdata(comedi_t *c, unsigned int s, unsigned int channel) {
    (void)channel;
    return s == AI || s == AO ? c->bits : s == GPCT0 || s == GPCT1 ? c->counter_bits : 1;
}
int comedi_get_n_ranges(comedi_t *c, unsigned int s, unsigned int channel) {
    (void)c, (void)channel;
    return s == AI ? 16 : s == AO ? 4 : 1;
}
comedi_range *comedi_get_range(comedi_t *c, unsigned int s, unsigned int channel, unsigned int range) {
    (void)c, (void)channel;
    return s == AI ? &ai_ranges[range] : &ao_ranges[range];
}
int comedi_lock(comedi_t *c, unsigned int s) { (void)s; if (c->locked) return refuse(EACCES); c->locked = 1; return 0; }
int comedi_unlock(comedi_t *c, unsigned int s) { (void)s; c->locked = 0; return 0; }

double comedi_to_phys(lsampl_t data, comedi_range *r, lsampl_t maxdata) {
    return r->min + (r->max - r->min) * data / maxdata;
}
lsampl_t comedi_from_phys(double volts, comedi_range *r, lsampl_t maxdata) {
    double x = floor((volts - r->min) / (r->max - r->min) * maxdata + 0.5);
    return x <= 0 ? 0 : x >= maxdata ? maxdata : (lsampl_t)x;
}
int comedi_data_read(comedi_t *c, unsigned int s, unsigned int channel, unsigned int range, unsigned int aref,
                     lsampl_t *data) {
    (void)aref;
    if (!c->is_open) return refuse(EBADF);
    if (s == AI) {
        if (fails(TYPE_AI, channel)) return -1;
        if (getenv("CARD_FAILS_IF") && !access(getenv("CARD_FAILS_IF"), F_OK)) return refuse(EIO); /* another process */
        comedi_range *r = &ai_ranges[range];
        double x = rint((c->in[channel] - r->min) / (r->max - r->min) * (c->bits + 1.0));
        *data = x <= 0 ? 0 : x >= c->bits ? c->bits : (lsampl_t)x;
        return 1;
    }
    if (s != GPCT0 && s != GPCT1) return refuse(EINVAL);
    if (fails(TYPE_COUNTER, s - GPCT0)) return -1;
    *data = c->counter[s - GPCT0].count;
    return 1;
}
int comedi_data_write(comedi_t *c, unsigned int s, unsigned int channel, unsigned int range, unsigned int aref,
                      lsampl_t data) {
    (void)aref;
    if (!c->is_open) return refuse(EBADF);
    if (s == GPCT0 || s == GPCT1) { c->counter[s - GPCT0].count = data; return 1; }
    if (s != AO || channel > 1 || data > c->bits) return refuse(EINVAL);
    if (fails(TYPE_AO, channel)) return -1;
    c->out[channel] = data, c->out_range[channel] = (int)range;
    return 1;
}
int comedi_dio_config(comedi_t *c, unsigned int s, unsigned int line, unsigned int direction) {
    if (s != DIO || line > 7) return refuse(EINVAL);
    c->outputs = (c->outputs & ~(1u << line)) | direction << line;
    return 1;
}
int comedi_dio_bitfield(comedi_t *c, unsigned int s, unsigned int mask, unsigned int *bits) {
    if (s != DIO || mask & ~c->outputs) return refuse(EINVAL);
    if (fails(TYPE_DIO, 0)) return -1;
    c->lines = (c->lines & ~mask) | (*bits & mask);
    *bits = c->lines;
    return 1;
}
int comedi_reset(comedi_t *c, unsigned int s) { memset(&c->counter[s - GPCT0], 0, sizeof c->counter[0]); return 0; }
int comedi_arm(comedi_t *c, unsigned int s, unsigned int source) {
    (void)source;
    c->counter[s - GPCT0].armed = 1;
    return 0;
}
int comedi_set_counter_mode(comedi_t *c, unsigned int s, unsigned int channel, unsigned int mode) {
    (void)channel;
    c->counter[s - GPCT0].mode = (int)mode;
    return 0;
}
int comedi_set_clock_source(comedi_t *c, unsigned int s, unsigned int channel, unsigned int clock, unsigned int ns) {
    (void)channel, (void)ns;
    c->counter[s - GPCT0].clock = (int)clock;
    return 0;
}
int comedi_set_gate_source(comedi_t *c, unsigned int s, unsigned int channel, unsigned int gate, unsigned int source) {
    (void)s, (void)channel, (void)source;
    return gate == 1 && !c->decoders ? refuse(EINVAL) : 0; /* the DAQ-STC has one gate */
}
int comedi_set_other_source(comedi_t *c, unsigned int s, unsigned int channel, unsigned int other, unsigned int source) {
    (void)channel;
    if (!c->decoders) return refuse(EINVAL);
    *(other ? &c->counter[s - GPCT0].b : &c->counter[s - GPCT0].a) = (int)source;
    return 0;
}
