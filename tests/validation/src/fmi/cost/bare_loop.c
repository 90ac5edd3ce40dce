/* Cost of a master in C without any service: usage
   LIBRARY FMUS pair|chain record|blind save|go [GUID RESOURCES].
   Outputs of t become inputs, then every FMU steps; each output is kept in memory where it is recorded.
   Prints the least CPU time in µs per FMU and step. */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
enum { ROUNDS = 15 };
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*free)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;
static void quiet(void *e, const char *n, int s, const char *c, const char *m, ...) {}
static const Callbacks callbacks = {quiet, calloc, free, 0, 0};
static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return t.tv_sec * 1e6 + t.tv_nsec * 1e-3;
}
int main(int argc, char **a) {
    if (argc != 6 && argc != 8) return 2;
    const char *guid = argc == 8 ? a[6] : "g", *resources = argc == 8 ? a[7] : "";
    void *l = dlopen(a[1], RTLD_NOW);
    if (!l) return 3;
    void *(*make)() = dlsym(l, "fmi2Instantiate");
    int (*step)(void *, double, double, int) = dlsym(l, "fmi2DoStep");
    int (*get)(void *, const unsigned *, size_t, double *) = dlsym(l, "fmi2GetReal");
    int (*set)(void *, const unsigned *, size_t, const double *) = dlsym(l, "fmi2SetReal");
    int (*keep)(void *, void **) = dlsym(l, "fmi2GetFMUstate");
    int fmus = atoi(a[2]), pair = !strcmp(a[3], "pair"), record = !strcmp(a[4], "record"), save = !strcmp(a[5], "save");
    int steps = 40000 / fmus, joined = pair ? fmus : fmus - 1;
    void **u = calloc(fmus, sizeof *u), **state = calloc(fmus, sizeof *state);
    double *y = calloc(fmus, sizeof *y), *rows = malloc(sizeof *rows * (fmus + 1) * (size_t)steps);
    int (*setup)(void *, int, double, double, int, double) = dlsym(l, "fmi2SetupExperiment");
    int (*enter)(void *) = dlsym(l, "fmi2EnterInitializationMode"), (*leave)(void *) = dlsym(l, "fmi2ExitInitializationMode");
    for (int k = 0; k < fmus; k++) {
        if (!(u[k] = make("x", 1, guid, resources, &callbacks, 0, 0))) return 5;
        if (setup(u[k], 0, 0, 0, 0, 0) || enter(u[k]) || leave(u[k])) return 6;
    }
    long now_at = 0;
    const unsigned in = 0, out = 1;
    double best = 1e99, sum = 0;
    for (int round = 0; round < ROUNDS; round++) {
        double start = now(), *row = rows;
        for (int i = 0; i < steps; i++) {
            for (int k = 0; k < joined; k++) if (get(u[k], &out, 1, &y[k])) return 4;
            for (int k = 0; k < joined; k++) if (set(u[(k + 1) % fmus], &in, 1, &y[k])) return 4;
            for (int k = 0; k < fmus; k++) {
                if (save && keep(u[k], &state[k])) return 4;
                if (step(u[k], now_at * 1e-3, 1e-3, !save)) return 4;
            }
            now_at++;
            if (record) {
                *row++ = now_at * 1e-3;
                for (int k = 0; k < fmus; k++) if (get(u[k], &out, 1, row++)) return 4;
            }
        }
        double took = (now() - start) / steps / fmus;
        if (took < best) best = took;
        sum += y[0];
    }
    printf("%.6f %g\n", best, sum);
    return 0;
}
