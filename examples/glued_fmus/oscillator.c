/* A mass on a spring and a damper, pushed by a force, as an FMU of FMI 2.0 for co-simulation: the least that can be glued.
   m dv/dt = f - k x - d v, dx/dt = v, in SI units, by the implicit midpoint rule with the force f held over the step. */
#include <stdlib.h>

/* Values by the value references of modelDescription.xml. */
enum { M, K, D, X, V, F, COUNT };
typedef struct { double value[COUNT]; } oscillator;

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const void *callbacks, int visible, int logging) {
    static const oscillator start = {{1.0, 100.0, 0.0, 0.0, 0.0, 0.0}};
    oscillator *o = malloc(sizeof *o);
    if (o) *o = start;
    return o;
}
void fmi2FreeInstance(oscillator *o) { free(o); }
int fmi2SetupExperiment(oscillator *o, int has_tolerance, double tolerance, double start, int has_stop, double stop) { return 0; }
int fmi2EnterInitializationMode(oscillator *o) { return 0; }
int fmi2ExitInitializationMode(oscillator *o) { return 0; }
int fmi2Terminate(oscillator *o) { return 0; }

int fmi2GetReal(oscillator *o, const unsigned *reference, size_t n, double *value) {
    for (size_t i = 0; i < n; i++) value[i] = o->value[reference[i]];
    return 0;
}
int fmi2SetReal(oscillator *o, const unsigned *reference, size_t n, const double *value) {
    for (size_t i = 0; i < n; i++) o->value[reference[i]] = value[i];
    return 0;
}

/* v' = v + h (f - k (x + x')/2 - d (v + v')/2)/m and x' = x + h (v + v')/2, solved for v'. */
int fmi2DoStep(oscillator *o, double t, double h, int keeps_no_state) {
    double *u = o->value, before = u[V];
    double implicit = u[M] + 0.5 * h * u[D] + 0.25 * h * h * u[K];
    u[V] += h * (u[F] - u[K] * (u[X] + 0.5 * h * before) - u[D] * before) / implicit;
    u[X] += 0.5 * h * (before + u[V]);
    return 0;
}

/* Gluing repeats a step from its start: the FMU gives its state and takes it back. */
int fmi2GetFMUstate(oscillator *o, oscillator **state) {
    if (!*state) *state = malloc(sizeof **state);
    if (!*state) return 3;
    **state = *o;
    return 0;
}
int fmi2SetFMUstate(oscillator *o, const oscillator *state) {
    *o = *state;
    return 0;
}
int fmi2FreeFMUstate(oscillator *o, oscillator **state) {
    free(*state);
    *state = NULL;
    return 0;
}
