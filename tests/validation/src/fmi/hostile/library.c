/* A library of both versions that shows when its code runs: it writes the file HOSTILE_MARK while it is loaded. It calls a
 * function of libm without being linked to it, as some tools build theirs. Its token is `g`. */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
double sin(double);
typedef struct { double x, t; } Fmu;
typedef void Log2(void *, const char *, int, const char *, const char *, ...);
typedef void Log3(void *, int, const char *, const char *);

__attribute__((constructor)) static void load(void) {
    const char *mark = getenv("HOSTILE_MARK");
    FILE *f = mark ? fopen(mark, "w") : 0;
    if (f) fclose(f);
}
static int step(Fmu *u, double t, double h) { u->t = t + h; u->x = sin(u->t); return 0; }

void *fmi2Instantiate(const char *n, int k, const char *guid, const char *r, void *const *back, int v, int l) {
    if (!strcmp(guid, "g")) return calloc(1, sizeof(Fmu));
    ((Log2 *)back[0])(back[4], n, 3, "logStatusError", "the token %s is not mine", guid);
    return 0;
}
void fmi2FreeInstance(Fmu *u) { free(u); }
int fmi2SetupExperiment(Fmu *u, int a, double b, double c, int d, double e) { return 0; }
int fmi2EnterInitializationMode(Fmu *u) { return 0; }
int fmi2ExitInitializationMode(Fmu *u) { return 0; }
int fmi2Terminate(Fmu *u) { return 0; }
int fmi2GetReal(Fmu *u, const unsigned *r, size_t n, double *x) { while (n--) x[n] = u->x; return 0; }
int fmi2SetReal(Fmu *u, const unsigned *r, size_t n, const double *x) { return 0; }
int fmi2DoStep(Fmu *u, double t, double h, int p) { return step(u, t, h); }

void *fmi3InstantiateCoSimulation(const char *n, const char *token, const char *r, bool v, bool l, bool e, bool a,
    const unsigned *q, size_t k, void *env, Log3 *log, void *update) {
    if (!strcmp(token, "g")) return calloc(1, sizeof(Fmu));
    log(env, 3, "logStatusError", "the token is not mine");
    return 0;
}
void fmi3FreeInstance(Fmu *u) { free(u); }
int fmi3EnterInitializationMode(Fmu *u, bool a, double b, double c, bool d, double e) { return 0; }
int fmi3ExitInitializationMode(Fmu *u) { return 0; }
int fmi3Terminate(Fmu *u) { return 0; }
int fmi3GetFloat64(Fmu *u, const unsigned *r, size_t n, double *x, size_t m) { while (m--) x[m] = u->x; return 0; }
int fmi3SetFloat64(Fmu *u, const unsigned *r, size_t n, const double *x, size_t m) { return 0; }
int fmi3DoStep(Fmu *u, double t, double h, bool g, bool *event, bool *end, bool *early, double *last) {
    *event = *end = *early = false;
    *last = t + h;
    return step(u, t, h);
}
