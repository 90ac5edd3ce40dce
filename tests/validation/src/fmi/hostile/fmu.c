/* An FMU of FMI 2.0 that misbehaves at one stage of its life. Its name says how and when: `segv_step`, or HOSTILE_NAME
 * does; while it is loaded it has no name yet, HOSTILE_LOAD says how. Steps misbehave after t = 0.25 s. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <fenv.h>
#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

typedef void Log(void *, const char *, int, const char *, const char *, ...);
typedef struct { Log *log; void *allocate, *release, *finished, *environment; } Back;
typedef struct { char name[64]; Back back; double *small; double x; } Fmu;

static void *idle(void *p) { for (;;) pause(); return p; }
static void *late(void *p) { usleep(20000); abort(); return p; }
static int deep(int n) { volatile char all[65536]; all[n % 65536] = 1; return deep(n + 1) + all[7]; }

static void threads(void *(*what)(void *), int n) {
    pthread_t t;
    while (n--) pthread_create(&t, 0, what, 0);
}

static void child(int leader) {
    if (fork()) return;
    if (leader) setsid();
    execlp("sleep", "sleep", "98765", (char *)0);
    _exit(1);
}

static void lines(Fmu *u, const char *what) {
    Back *b = &u->back;
    if (!strcmp(what, "flood")) for (int i = 0; i < 100000; i++) b->log(b->environment, u->name, 1, "c", "line %d", i);
    if (!strcmp(what, "null")) b->log(b->environment, 0, 0, 0, 0);
    if (!strcmp(what, "utf")) b->log(b->environment, u->name, 1, "c", "\xff\xfe\xc3(");
    if (!strcmp(what, "huge")) {
        char *text = malloc(64 << 20);
        memset(text, 'a', (64 << 20) - 1);
        text[(64 << 20) - 1] = 0;
        b->log(b->environment, u->name, 1, "c", "%s", text);
        free(text);
    }
}

static int act(Fmu *u, const char *what) {
    if (u) lines(u, what);
    if (!strcmp(what, "abort")) abort();
    if (!strcmp(what, "exit")) exit(0);
    if (!strcmp(what, "gone")) _exit(0);
    if (!strcmp(what, "segv")) *(volatile int *)8 = 1;
    if (!strcmp(what, "deep")) deep(0);
    if (!strcmp(what, "hang")) for (;;) pause();
    if (!strcmp(what, "stop")) kill(getpid(), SIGSTOP);
    if (!strcmp(what, "heap")) { double *p = malloc(24); memset((char *)p - 16, 0x55, 64); free(p); }
    if (!strcmp(what, "overrun")) memset(malloc(8), 0x55, 1 << 28);
    if (!strcmp(what, "memory")) for (;;) memset(malloc(64 << 20), 1, 64 << 20);
    if (!strcmp(what, "close")) for (int i = 3; i < 256; i++) close(i);
    if (!strcmp(what, "folder")) { if (chdir("/")) abort(); }
    if (!strcmp(what, "locale")) { setlocale(LC_ALL, "de_DE.UTF-8"); setlocale(LC_ALL, "C"); setenv("LC_ALL", "de_DE", 1); }
    if (!strcmp(what, "mask")) umask(0777);
    if (!strcmp(what, "signal")) {
        sigset_t all;
        sigfillset(&all);
        pthread_sigmask(SIG_BLOCK, &all, 0);
        for (int i = 1; i < 32; i++) signal(i, SIG_IGN);
    }
    if (!strcmp(what, "round")) fesetround(FE_UPWARD);
    if (!strcmp(what, "thread")) threads(idle, 20);
    if (!strcmp(what, "late")) { threads(late, 1); usleep(40000); }
    if (!strcmp(what, "child")) { child(0); child(1); }
    return !strcmp(what, "discard") ? 2 : !strcmp(what, "error") ? 3 : !strcmp(what, "fatal") ? 4 : 0;
}

static int at(Fmu *u, const char *stage) {
    char what[64];
    strcpy(what, u->name);
    char *cut = strchr(what, '_');
    if (!cut || strcmp(cut + 1, stage)) return 0;
    *cut = 0;
    if (!strcmp(what, "nan")) u->x = NAN;
    if (!strcmp(what, "infinite")) u->x = INFINITY;
    return act(u, what);
}

__attribute__((constructor)) static void load(void) {
    const char *what = getenv("HOSTILE_LOAD");
    if (what) act(0, what);
}

void *fmi2Instantiate(const char *n, int t, const char *g, const char *r, const Back *b, int v, int l) {
    Fmu *u = calloc(1, sizeof *u);
    const char *name = getenv("HOSTILE_NAME");
    strncpy(u->name, name ? name : n, 63);
    u->back = *b;
    u->x = 1;
    return at(u, "instantiate") ? 0 : u;
}
void fmi2FreeInstance(Fmu *u) { at(u, "free"); }
int fmi2SetupExperiment(Fmu *u, int a, double b, double c, int d, double e) { return 0; }
int fmi2EnterInitializationMode(Fmu *u) { return at(u, "initialise"); }
int fmi2ExitInitializationMode(Fmu *u) { return 0; }
int fmi2Terminate(Fmu *u) { return at(u, "terminate"); }
int fmi2GetReal(Fmu *u, const unsigned *r, size_t n, double *x) {
    while (n--) x[n] = u->x;
    if (!strcmp(u->name, "overrun_get")) memset(x, 0x55, 1 << 26);
    return 0;
}
int fmi2SetReal(Fmu *u, const unsigned *r, size_t n, const double *x) { return 0; }
int fmi2DoStep(Fmu *u, double t, double h, int p) { return t > 0.25 ? at(u, "step") : 0; }
