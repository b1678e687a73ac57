/* A carriage on a guide as an FMU, for tests: m x'' = K u - d x', FMI 2 and FMI 3 in one library.
 * u is in V, x in mm. Parameter `fail_at` (s) makes a step fail from then on.
 */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>

enum { U, X, M, K, D, FAIL_AT, SPEED, BARE, COUNT };
typedef struct { double value[COUNT]; } Carriage;

static void *new_carriage(void) {
    Carriage *c = calloc(1, sizeof *c);
    c->value[M] = 95.1, c->value[K] = 35.15, c->value[D] = 203.5, c->value[FAIL_AT] = 1e9;
    return c;
}
static int get(const Carriage *c, const unsigned *vr, size_t n, double *values) {
    for (size_t i = 0; i < n; i++) values[i] = c->value[vr[i]] * (vr[i] == X || vr[i] == SPEED ? 1000.0 : 1.0);
    return 0;
}
static int set(Carriage *c, const unsigned *vr, size_t n, const double *values) {
    for (size_t i = 0; i < n; i++) c->value[vr[i]] = values[i];
    return 0;
}
/* exact for a constant force: v decays to K u / d */
static int step(Carriage *c, double t, double h) {
    double *s = c->value, a = s[D] / s[M], end = s[K] * s[U] / s[D], e = exp(-a * h);
    if (t + h > s[FAIL_AT]) return 3;
    s[X] += end * h + (s[SPEED] - end) * (1 - e) / a;
    s[SPEED] = end + (s[SPEED] - end) * e;
    return 0;
}

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *folder, const void *callbacks, int visible,
                      int logging) {
    (void)name, (void)type, (void)guid, (void)folder, (void)callbacks, (void)visible, (void)logging;
    return new_carriage();
}
void fmi2FreeInstance(void *c) { free(c); }
int fmi2SetupExperiment(void *c, int known, double tolerance, double start, int ends, double stop) {
    (void)c, (void)known, (void)tolerance, (void)start, (void)ends, (void)stop;
    return 0;
}
int fmi2EnterInitializationMode(void *c) { (void)c; return 0; }
int fmi2ExitInitializationMode(Carriage *c) { return c->value[M] > 0 ? 0 : 3; }
int fmi2GetReal(void *c, const unsigned *vr, size_t n, double *values) { return get(c, vr, n, values); }
int fmi2SetReal(void *c, const unsigned *vr, size_t n, const double *values) { return set(c, vr, n, values); }
int fmi2DoStep(void *c, double t, double h, int no_rollback) { (void)no_rollback; return step(c, t, h); }

void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *folder, _Bool visible, _Bool logging,
                                  _Bool event_mode, _Bool early_return, const unsigned *required, size_t count,
                                  void *environment, void *log, void *update) {
    (void)name, (void)token, (void)folder, (void)visible, (void)logging, (void)event_mode, (void)early_return;
    (void)required, (void)count, (void)environment, (void)log, (void)update;
    return new_carriage();
}
void fmi3FreeInstance(void *c) { free(c); }
int fmi3EnterInitializationMode(void *c, _Bool known, double tolerance, double start, _Bool ends, double stop) {
    (void)c, (void)known, (void)tolerance, (void)start, (void)ends, (void)stop;
    return 0;
}
int fmi3ExitInitializationMode(void *c) { (void)c; return 0; }
int fmi3GetFloat64(void *c, const unsigned *vr, size_t n, double *values, size_t count) {
    (void)count;
    return get(c, vr, n, values);
}
int fmi3SetFloat64(void *c, const unsigned *vr, size_t n, const double *values, size_t count) {
    (void)count;
    return set(c, vr, n, values);
}
int fmi3DoStep(void *c, double t, double h, _Bool no_rollback, _Bool *event, _Bool *terminate, _Bool *early, double *last) {
    (void)no_rollback;
    *event = *terminate = *early = 0, *last = t + h;
    return step(c, t, h);
}
