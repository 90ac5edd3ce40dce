/* FMI 3.0: a source of N equal numbers, a sink that counts how often its array is set and how often it sees one that is set in
 * part, and a clock whose solver has a grid of its own (GRID, s). */
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#ifndef N
#define N 12
#endif
typedef struct { double a[N], sets, torn, t; } Fmu;
void *fmi3InstantiateCoSimulation(const char *n, const char *token, const char *r, bool v, bool l, bool e, bool a,
    const unsigned *q, size_t k, void *env, void *log, void *update) { return calloc(1, sizeof(Fmu)); }
void fmi3FreeInstance(Fmu *u) { free(u); }
int fmi3EnterInitializationMode(Fmu *u, bool a, double b, double c, bool d, double e) { return 0; }
int fmi3ExitInitializationMode(Fmu *u) { u->sets = 0; return 0; }
int fmi3Terminate(Fmu *u) { return 0; }
int fmi3GetFloat64(Fmu *u, const unsigned *r, size_t n, double *x, size_t m) {
    for (size_t i = 0; i < n; i++) switch (r[i]) {
        case 1: memcpy(x, u->a, sizeof u->a); x += N; break;
        case 2: *x++ = u->sets; break;
        case 3: *x++ = u->torn; break;
        case 4: for (int k = 0; k < N; k++) *x++ = u->t; break;
        default: *x++ = u->t;
    }
    return 0;
}
int fmi3SetFloat64(Fmu *u, const unsigned *r, size_t n, const double *x, size_t m) {
    if (n != 1 || r[0] != 1 || m != N) return 3;
    memcpy(u->a, x, sizeof u->a);
    u->sets += 1;
    for (int k = 1; k < N; k++) if (u->a[k] != u->a[0]) { u->torn += 1; break; }
    return 0;
}
int fmi3DoStep(Fmu *u, double t, double h, bool g, bool *event, bool *end, bool *early, double *last) {
    *event = *end = *early = false;
    u->t = t + h;
#ifdef GRID
    u->t = floor((t + h) / GRID + 1e-9) * GRID;
#endif
    *last = u->t;
    return 0;
}
