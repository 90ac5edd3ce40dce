/* broken-soil: a spring with friction below each foot, with a switch for every mistake that the checker must find. */
#include <fenv.h>
#include <locale.h>
#include <pthread.h>
#include <signal.h>
#include <time.h>
#include <unistd.h>
#include "broken.h"

#if !defined BROKEN_NO_SECTION
#define SAYS(kind, words, unit) TG_DESCRIBE("broken-soil", "1.0.0", TG_IS(kind) TG_CAN(words) \
    TG_HAS("stiffness", "parameter", "f64", unit) TG_HAS("mu", "parameter", "f64", "") \
    TG_HAS("deepest", "output", "f64", "m") TG_HAS("work", "output", "f64", "J"))
#define WORDS "force motion solve derivatives retry state serialize"
#if BROKEN_OTHER_KIND
SAYS("robot", WORDS, "N/m");
#elif BROKEN_OTHER_WORDS
SAYS("soil", WORDS " ramp", "N/m");
#elif BROKEN_OTHER_UNIT
SAYS("soil", WORDS, "N");
#else
SAYS("soil", WORDS, "N/m");
#endif
#else
static const char *const tg_description = NULL;
#endif
#define MAX_FEET 64
#define STATE_MAGIC 0x736f696cu

typedef struct { uint64_t key; double tangential[3], stored; } foot; /* committed friction on the body, world, N; energy of the springs, J */
typedef struct { uint32_t magic, n_feet; foot feet[MAX_FEET]; double work, lost, deepest; } state;
typedef struct { double x[3], t[3], slope, trial; bool force, motion; } answer;
typedef struct {
    double k, k_t, mu, limit, origin[2], spacing, *height, *surface;
    uint32_t size[2], n_slots, of_port[MAX_FEET], trials, commits, ports_before, tried;
    state now, *slots;
    uint8_t bytes[sizeof(state)];
    answer last[MAX_FEET];
    double *scratch;
    char error[160];
    uint64_t generation;
} soil;
static uint32_t instances;
static state shared;
static _Thread_local uint32_t calls_of_thread;
static state *state_of(soil *s) { return BROKEN(SHARED_STATE) ? &shared : &s->now; }

/* ---- harm that a library does to its host when it is loaded ---- */
__attribute__((unused)) static void *sleeper(void *unused) { for (;;) sleep(1000); return unused; }
__attribute__((unused)) static void on_signal(int unused) { (void)unused; }
static void disturb(void) {
    if (BROKEN(ROUNDING)) fesetround(FE_UPWARD);
#ifdef __SSE2__
    if (BROKEN(FLUSHES)) __builtin_ia32_ldmxcsr(__builtin_ia32_stmxcsr() | 0x8040); /* as crtfastmath.o does */
#endif
    if (BROKEN(SIGNALS)) signal(SIGUSR1, on_signal);
    if (BROKEN(LOCALE)) setlocale(LC_ALL, "C.UTF-8");
    if (BROKEN(DIRECTORY) && chdir("/")) return;
    if (BROKEN(ENVIRONMENT)) setenv("BROKEN_SOIL", "1", 1);
    if (BROKEN(THREAD)) { pthread_t t; pthread_create(&t, NULL, sleeper, NULL); }
    if (BROKEN(OPEN_FILE) && !fopen("/dev/null", "r")) return;
}
__attribute__((constructor)) static void loaded(void) { if (BROKEN(AT_LOAD)) disturb(); }
#ifdef BROKEN_UNDEFINED_SYMBOL
extern double no_such_function_anywhere(double);
double (*volatile undefined)(double) = no_such_function_anywhere;
#endif
#ifdef BROKEN_MORE_EXPORTS
double helper(double x) { return 2.0 * x; }
#endif

#define PARAMETER(name, unit, value, rule, help) "{\"name\":\"" name "\",\"type\":\"number\",\"unit\":\"" unit \
    "\",\"default\":" value "," rule ",\"help\":\"" help "\"}"
#define ABOVE_ZERO "\"min\":0.0,\"above_min\":true"
#define HEAD "{\"name\":\"broken-soil\",\"kind\":\"soil\",\"help\":\"" 
#define K PARAMETER("stiffness", "N/m", "20000.0", ABOVE_ZERO, "Stiffness below a foot")
#define KT PARAMETER("tangential", "N/m", "20000.0", ABOVE_ZERO, "Stiffness along the ground")
#define MU PARAMETER("mu", "", "0.7", "\"min\":0.0,\"max\":2.0", "Coulomb coefficient")
static const char *schema(void) {
    static int asked;
    if (BROKEN(SCHEMA_CHANGES) && instances > 0 && asked++ > 0) return HEAD "another\",\"parameters\":[" K "," KT "," MU "]}";
    if (BROKEN(SCHEMA_TWICE)) return HEAD "springs\",\"parameters\":[" K "," KT "," MU "," K "]}";
    if (BROKEN(SCHEMA_UNIT)) return HEAD "springs\",\"parameters\":["
        PARAMETER("stiffness", "newton", "20000.0", ABOVE_ZERO, "Stiffness") "," KT "," MU "]}";
    if (BROKEN(SCHEMA_DEFAULT)) return HEAD "springs\",\"parameters\":[" K "," KT ","
        PARAMETER("mu", "", "0.7", "\"max\":0.5", "Coulomb coefficient") "]}";
    if (BROKEN(SCHEMA_HELP)) return HEAD "\",\"parameters\":[" K "," KT "," MU "]}";
    return HEAD "springs\",\"parameters\":[" K "," KT "," MU "]}";
}

static double depth(const soil *s, const tg_port *p) { /* of the foot at t, m; bilinear, outside as at the edge */
    if (!s->height) return -p->origin[2] * p->frame[2];
    double at[2];
    uint32_t i[2];
    for (int a = 0; a < 2; a++) {
        at[a] = fmin(fmax((p->origin[a] - s->origin[a]) / s->spacing, 0.0), s->size[a] - 1.0);
        i[a] = (uint32_t)fmin(at[a], s->size[a] - 2.0);
        at[a] -= i[a];
    }
    const double *h = s->height + (size_t)i[1] * s->size[0] + i[0], *up = h + s->size[0];
    double low = h[0] + at[0] * (h[1] - h[0]), high = up[0] + at[0] * (up[1] - up[0]);
    return (low + at[1] * (high - low) - p->origin[2]) * p->frame[2];
}

static void destroy(void *self) {
    soil *s = self;
    free(s->height); free(s->surface); free(s->slots); free(s->scratch);
    if (BROKEN(FREES_TWICE)) free(s->slots);
    if (!BROKEN(LEAKS_INSTANCE)) free(s);
}
static tg_status instantiate(const tg_host *host, const char *config, void **self) {
    soil *s = calloc(1, sizeof *s);
    if (!s) return fail(failure, "no memory");
    s->now.magic = STATE_MAGIC;
    s->k = number(config, "\"stiffness\""), s->k_t = number(config, "\"tangential\""), s->mu = number(config, "\"mu\"");
    s->limit = 1.0, s->n_slots = host->slots;
    s->slots = calloc(host->slots, sizeof *s->slots);
    s->scratch = malloc(64 * sizeof *s->scratch);
    const tg_terrain *g = host->terrain;
    if (g && g->size[0] > 1 && g->size[1] > 1) {
        for (int a = 0; a < 2; a++) s->origin[a] = g->origin[a], s->size[a] = g->size[a];
        s->spacing = g->spacing;
        s->height = malloc((size_t)g->size[0] * g->size[1] * sizeof *s->height);
        s->surface = malloc((size_t)g->size[0] * g->size[1] * sizeof *s->height);
    }
    bool read = !g || (s->height && g->heights(g->ctx, 0, 0, s->size[0], s->size[1], s->height) >= 0);
    if (s->surface) memcpy(s->surface, s->height, (size_t)s->size[0] * s->size[1] * sizeof *s->height);
    bool sense = s->k > 0.0 && s->k_t > 0.0 && s->mu >= 0.0;
    if (!s->slots || !s->scratch || !read || !sense || BROKEN(REFUSES_ALL)) {
        destroy(s);
        return fail(failure, BROKEN(NO_REASON) ? "" : "a parameter is missing, or the terrain cannot be read");
    }
    if (!BROKEN(AT_LOAD)) disturb();
    if (BROKEN(SHARED_STATE) && instances == 0) shared = s->now;
    if (BROKEN(COUNTS_INSTANCES)) s->k *= 1.0 + 1e-6 * instances;
    if (BROKEN(PROCESS_NUMBER)) s->k *= 1.0 + 1e-9 * getpid();
    instances++;
    *self = s;
    return TG_OK;
}
static uint32_t capabilities(void *self) {
    (void)self;
    return TG_CAN_FORCE | TG_CAN_MOTION | TG_CAN_DERIVATIVES | TG_CAN_RETRY | TG_CAN_STATE | TG_CAN_SERIALIZE | TG_CAN_SOLVE;
}

/* ---- the law ---- */
static double law(const soil *s, double z, double *slope) {
    bool in = z > 0.0;
    *slope = in ? s->k : 0.0;
    if (BROKEN(PULLS) && z > -0.004) return *slope = s->k, s->k * z;
    if (BROKEN(FELT_ABOVE) && !in) return 0.5;
    if (BROKEN(PUSHES_DOWN) && z > 0.006) return -s->k * z;
    if (BROKEN(GIVES_WAY) && z > 0.01) return 0.2 * s->k * z;
    if (BROKEN(OVERFLOWS)) return in ? s->k * z * (1.0 + 1e-300 * exp(8000.0 * z)) : 0.0;
    if (BROKEN(ENDS_AT_DEPTH) && z > 0.6) return NAN;
    return in ? s->k * z : 0.0;
}
static double depth_at(const soil *s, double force, double *slope) {
    double k = BROKEN(WRONG_INVERSE) ? 0.5 * s->k : s->k;
    *slope = 1.0 / k;
    if (BROKEN(ENDS_AT_FORCE) && force > 1e5) return NAN;
    return force / k;
}
/* The law at X for a normal force (given, or NAN: that of the spring): fills the answer of a port. */
static void respond(const soil *s, const tg_step *st, const tg_port *p, const foot *f, const double x[3], double t_n, answer *a) {
    double z = depth(s, p), k_t = s->k_t, factor = 1.0;
    a->x[0] = x[0], a->t[0] = t_n;
    if (BROKEN(WORLD_ORIGIN)) factor *= 1.0 + p->origin[0];
    if (BROKEN(WORLD_HEIGHT)) factor *= 1.0 + 0.1 * floor(p->origin[2]);
    if (BROKEN(FEELS_OTHERS)) factor /= st->n_ports;
    if (BROKEN(GAINS_ENERGY) && x[0] > 1e-9) factor *= 1.3;
    if (BROKEN(STEP_LENGTH)) factor *= 1.0 + 500.0 * st->h;
    if (isnan(t_n)) a->t[0] = factor * law(s, z - x[0], &a->slope), a->slope *= factor;
    else a->x[0] = z - depth_at(s, t_n, &a->slope);
    for (int c = 1; c < 3; c++) {
        const double *d = p->frame + 3 * c;
        if (BROKEN(FRAME_DEPENDS)) k_t = c == 1 ? s->k_t : 0.5 * s->k_t;
        a->t[c] = dot(d, f->tangential) - k_t * x[c];
        if (BROKEN(HELPS_SLIDING)) a->t[c] = dot(d, f->tangential) + k_t * x[c];
        a->x[c] = x[c];
    }
    double mu = s->mu;
    if (BROKEN(TOO_MUCH_FRICTION)) mu *= 1.5;
    if (BROKEN(TOO_LITTLE_FRICTION)) mu *= 0.3;
    if (BROKEN(GRAIN) && fabs(p->frame[3] * a->t[1] + p->frame[6] * a->t[2]) > fabs(p->frame[4] * a->t[1] + p->frame[7] * a->t[2])) mu *= 0.8;
    double size = hypot(a->t[1], a->t[2]), bound = mu * fmax(a->t[0], 0.0);
    a->trial = size > bound ? size : 0.0;
    for (int c = 1; c < 3 && size > bound; c++) a->t[c] = BROKEN(SQUARE_FRICTION) ? copysign(fmin(fabs(a->t[c]), bound), a->t[c]) : a->t[c] * bound / size;
}
static void pack(const tg_step *st, const tg_port *p, const answer *a, tg_response *out) {
    for (uint32_t c = 0, i = p->first; c < 6; c++) {
        if (!(p->mask >> c & 1)) continue;
        out->x[i] = c < 3 ? a->x[c] : 0.0, out->t[i] = c < 3 ? a->t[c] : 0.0;
        if (BROKEN(WRONG_MOMENT) && c == 4) out->t[i] = 0.02 * a->t[0];
        if (!(BROKEN(FORGETS_COMPONENT) && c == 2)) out->v[i] = 0.0;
        out->a[i] = 0.0;
        if (BROKEN(DIVIDES_BY_STEP)) out->v[i] = out->x[i] / st->h;
        i++;
    }
}

static const double still[3];
static tg_status set_ports(void *self, const tg_step *st, tg_law *laws, tg_response *now) {
    soil *s = self;
    state *q = state_of(s);
    if (BROKEN(NEEDS_A_FOOT) && st->n_ports == 0) return fail(s->error, "no feet");
    if (BROKEN(NO_FEWER_FEET) && st->n_ports < s->ports_before) abort();
    s->ports_before = st->n_ports;
    for (uint32_t p = 0; p < st->n_ports; p++) {
        const tg_port *port = &st->ports[p];
        uint32_t f = 0;
        while (f < q->n_feet && q->feet[f].key != port->key) f++;
        if ((port->mask & 7) != 7) return fail(s->error, "a port does not carry n, t1 and t2");
        if (f == MAX_FEET) { if (BROKEN(TOO_MANY_FEET)) __builtin_trap(); else return fail(s->error, "more than 64 feet"); }
        if (f == q->n_feet) q->feet[q->n_feet++] = (foot){ .key = port->key };
        s->of_port[p] = f;
        respond(s, st, port, &q->feet[f], still, NAN, &s->last[p]);
        s->last[p].x[0] = BROKEN(SURFACE_AT_FOOT) ? 0.0 : fmin(depth(s, port), 0.0);
        if (BROKEN(SURFACE_UNDEFORMED)) s->last[p].x[0] = depth(s, port);
        if (BROKEN(NO_FORCE_NOW)) s->last[p].t[0] = s->last[p].t[1] = s->last[p].t[2] = 0.0;
        pack(st, port, &s->last[p], now);
        laws[p].mu = fmin(laws[p].mu, s->mu);
    }
    return TG_OK;
}
static void count_jobs(void *arg, size_t index) { ((double *)arg)[index % 64] += 1.0; }
static tg_status advance(void *self, const tg_step *st, const tg_input *in, tg_response *out) {
    soil *s = self;
    state *q = state_of(s);
    s->tried = 1;
    if (BROKEN(HANGS) && s->commits > 5) for (;;) usleep(1000);
    if (BROKEN(CRASHES) && s->commits > 5) *(volatile int *)8 = 1;
    if (BROKEN(UNKNOWN_STATUS) && s->commits > 5) return 4711;
    if (BROKEN(EXITS) && s->commits > 5) exit(0);
    if (BROKEN(PRINTS) && s->commits == 5) puts("five steps");
    if (BROKEN(PRINTS_ERRORS) && s->commits == 5) fputs("five steps\n", stderr);
    if (BROKEN(ALLOCATES)) { double *volatile room = malloc(64); room[0] = 0.0; s->scratch[1] = room[0]; free(room); }
    if (BROKEN(LEAKS_STEPS)) { double *volatile lost = malloc(48); lost[0] = st->t; s->scratch[1] = lost[0]; }
    (void)count_jobs;
    for (uint32_t p = 0; p < st->n_ports; p++) {
        const tg_port *port = &st->ports[p];
        answer *a = &s->last[p];
        foot *f = &q->feet[s->of_port[p]];
        a->force = in->kind == TG_FORCE, a->motion = in->x != NULL;
        const double *t = a->force ? in->t + port->first : NULL, *x = a->motion ? in->x + port->first : still;
        respond(s, st, port, f, x, t ? t[0] : NAN, a);
        for (int c = 1; c < 3 && t && !a->motion; c++) /* force alone: the spring yields until it carries it */
            a->x[c] = (a->t[c] - t[c]) / s->k_t, a->t[c] = t[c];
        if (BROKEN(NAN_ANSWER) && s->commits > 5) a->t[1] = 0.0 / (a->t[0] * 0.0);
        if (BROKEN(REMEMBERS_TRIALS)) a->t[0] *= 1.0 + 1e-9 * (s->trials++ % 3);
        if (BROKEN(READS_UNWRITTEN)) a->t[0] += 1e-12 * (s->scratch[40] != s->scratch[40] ? 1.0 : copysign(fmin(fabs(s->scratch[40]), 1.0), s->scratch[40]));
        if (BROKEN(READS_CLOCK)) { struct timespec now; clock_gettime(CLOCK_MONOTONIC, &now); a->t[0] *= 1.0 + 1e-18 * now.tv_nsec + 1e-9 * (now.tv_nsec % 7); }
        if (BROKEN(THREAD_MEMORY)) a->t[0] *= 1.0 + 1e-9 * (calls_of_thread++ > 60);
        if (BROKEN(TRIALS_COMMIT) && a->motion) for (int k = 0; k < 3; k++) f->tangential[k] = port->frame[3 + k] * a->t[1] + port->frame[6 + k] * a->t[2];
        if (BROKEN(TRIALS_SHOW)) q->deepest = fmax(q->deepest, depth(s, port) - a->x[0]);
        if (BROKEN(SHEAR_GAINS) && a->trial > 0.0 && x[1] * port->frame[3] + x[2] * port->frame[6] < 0.0)
            a->t[1] *= -1.5, a->t[2] *= -1.5;
        pack(st, port, a, out);
    }
    if (BROKEN(ENDS_EARLY)) out->reached = st->t - st->h;
    return TG_OK;
}
static tg_status solve_compatibility(void *self, const tg_step *st, const tg_estimate *e, tg_response *out) {
    soil *s = self;
    for (uint32_t p = 0; p < st->n_ports; p++) {
        const tg_port *port = &st->ports[p];
        const double *t = e->t_star + port->first;
        answer a = { 0 };
        respond(s, st, port, &state_of(s)->feet[s->of_port[p]], still, NAN, &a);
        double most = BROKEN(KEEPS_ESTIMATE) ? INFINITY : fmax(a.t[0], 0.0), wanted = hypot(t[1], t[2]);
        a.t[0] = fmax(fmin(t[0], most), 0.0);
        double share = wanted > s->mu * a.t[0] ? s->mu * a.t[0] / wanted : 1.0;
        for (int c = 1; c < 3; c++) a.t[c] = share * t[c];
        a.x[0] = fmin(depth(s, port), 0.0), a.x[1] = a.x[2] = 0.0;
        pack(st, port, &a, out);
    }
    return TG_OK;
}
static tg_status interface_jacobian(void *self, const tg_step *st, uint32_t level, double *out) {
    soil *s = self;
    if (BROKEN(JACOBIAN_FIRST) && !s->tried && st->n_ports) abort();
    if (level > TG_VELOCITY) return TG_UNSUPPORTED;
    memset(out, 0, sizeof *out * st->n * st->n);
    for (uint32_t p = 0; p < st->n_ports && level == TG_POSITION; p++) {
        const answer *a = &s->last[p];
        double v, bound = s->mu * a->t[0], d[3] = { 0.0, 0.0, 0.0 };
        double share = a->trial > 0.0 ? bound / a->trial : 1.0; /* 1: sticks; else it slides along d */
        for (int c = 1; c < 3 && a->trial > 0.0 && bound > 0.0; c++) d[c] = a->t[c] / bound;
        for (int e = 0; e < 9; e++) {
            int r = e % 3, c = e / 3;
            if (r == 0) v = c > 0 ? 0.0 : a->slope;
            else if (a->force && !a->motion) v = r == c ? 1.0 / s->k_t : 0.0;
            else if (c == 0) v = BROKEN(JACOBIAN_COUPLING) ? 0.0 : s->mu * d[r] * (a->force ? 1.0 : a->slope);
            else v = s->k_t * share * ((r == c) - (BROKEN(JACOBIAN_SLIDING) ? 0.0 : d[r] * d[c]));
            if (BROKEN(JACOBIAN_SIGN)) v = -v;
            if (BROKEN(JACOBIAN_FACTOR) && e == 0) v *= 1.02;
            if (BROKEN(JACOBIAN_FORCE) && a->force && e == 0) v = s->k;
            out[(size_t)(st->ports[p].first + (BROKEN(JACOBIAN_TRANSPOSED) ? r : c)) * st->n + st->ports[p].first + (BROKEN(JACOBIAN_TRANSPOSED) ? c : r)] = v;
        }
    }
    return TG_OK;
}
static tg_status commit(void *self, const tg_step *st, const double *t, const tg_motion *body) {
    soil *s = self;
    state *q = state_of(s);
    s->commits++;
    for (uint32_t p = 0; p < st->n_ports; p++) {
        const tg_port *port = &st->ports[p];
        const double *frame = port->frame, *x = body->x + port->first;
        foot *f = &q->feet[s->of_port[p]];
        answer a;
        respond(s, st, port, f, x, NAN, &a);
        double old[3] = { f->tangential[0], f->tangential[1], f->tangential[2] };
        for (int k = 0; k < 3; k++) f->tangential[k] = frame[3 + k] * a.t[1] + frame[6 + k] * a.t[2];
        if (BROKEN(KEEPS_SHEAR) && a.t[0] <= 0.0) memcpy(f->tangential, old, sizeof old);
        double work = -(a.t[0] * x[0] + a.t[1] * x[1] + a.t[2] * x[2]), before = f->stored, z = fmax(depth(s, port) - x[0], 0.0);
        (void)t; /* the work of the soil's own law, whatever T was */
        f->stored = 0.5 * (s->k * z * z + dot(f->tangential, f->tangential) / s->k_t);
        q->work += BROKEN(WORK_SIGN) ? -work : work;
        if (BROKEN(LOSES_LESS) && x[0] > 0.0) q->lost -= 1e-3;
        else if (!BROKEN(NO_HEAT)) q->lost += work - (f->stored - before);
        q->deepest = fmax(q->deepest, depth(s, port) - x[0]);
        for (uint32_t k = port->first_node; s->surface && k < port->first_node + port->node_count; k++) {
            const tg_node *n = &st->nodes[k];
            if (n->i < 0 || n->j < 0 || n->i >= (int32_t)s->size[0] || n->j >= (int32_t)s->size[1]) continue;
            double *h = &s->surface[(size_t)n->j * s->size[0] + n->i], under = n->lower + x[0];
            if (under < *h && !BROKEN(GROUND_STAYS)) *h = under;
            if (BROKEN(GROUND_GROWS)) s->surface[0] += 1e-3;
        }
        s->generation++;
    }
    return TG_OK;
}

/* ---- states ---- */
static tg_status save_state(void *self, uint32_t slot) {
    soil *s = self;
    if (slot >= s->n_slots) { if (BROKEN(ANY_SLOT)) return TG_OK; else return fail(s->error, "no such slot"); }
    s->slots[BROKEN(ONE_SLOT) ? 0 : slot] = *state_of(s);
    if (BROKEN(SAVING_CLEARS) && state_of(s)->n_feet) state_of(s)->feet[0].tangential[0] = 0.0;
    return TG_OK;
}
static tg_status restore_state(void *self, uint32_t slot) {
    soil *s = self;
    if (slot >= s->n_slots) { if (BROKEN(ANY_SLOT)) return TG_OK; else return fail(s->error, "no such slot"); }
    double work = state_of(s)->work;
    foot first = state_of(s)->feet[0];
    *state_of(s) = s->slots[BROKEN(ONE_SLOT) ? 0 : slot];
    if (BROKEN(RESTORES_NO_WORK)) state_of(s)->work = work;
    if (BROKEN(RESTORES_NO_SHEAR)) state_of(s)->feet[0] = first;
    return TG_OK;
}
static tg_status serialize(void *self, tg_bytes *out) {
    soil *s = self;
    memcpy(s->bytes, state_of(s), sizeof s->bytes);
    if (BROKEN(WRITES_NO_WORK)) ((state *)(void *)s->bytes)->work = 0.0;
    if (BROKEN(WRITES_POINTER)) { soil *own = s; memcpy(s->bytes + 8, &own, sizeof own); }
    out->data = s->bytes, out->size = sizeof s->bytes;
    return TG_OK;
}
static tg_status deserialize(void *self, tg_bytes bytes) {
    soil *s = self;
    state read;
    if (BROKEN(READS_ANYTHING)) {
        memcpy(state_of(s), bytes.data ? bytes.data : s->bytes, bytes.size < sizeof read ? bytes.size : sizeof read);
        state_of(s)->n_feet %= MAX_FEET;
        return TG_OK;
    }
    if (bytes.size != sizeof read) return fail(s->error, "these bytes are no state of this soil"), TG_REFUSED;
    memcpy(&read, bytes.data, sizeof read);
    if (read.magic != STATE_MAGIC || read.n_feet > MAX_FEET) return fail(s->error, "these bytes are no state of this soil"), TG_REFUSED;
    if (BROKEN(WRITES_POINTER)) { soil *other; memcpy(&other, bytes.data + 8, sizeof other); read = other->now; }
    *state_of(s) = read;
    return TG_OK;
}

/* ---- values ---- */
static const tg_variable VARIABLES[] = {
    { 0, TG_F64, TG_PARAMETER, TG_LIVE, "stiffness", "N/m", "Stiffness below a foot", 1.0, 1e9, NULL, NULL, 0, 0 },
    { 1, TG_F64, TG_PARAMETER, TG_LIVE, "mu", "", "Coulomb coefficient", 0.0, 2.0, NULL, NULL, 0, 0 },
    { 2, TG_F64, TG_OUTPUT, TG_READ_ONLY, "deepest", "m", "Deepest foot since the start", 0.0, INFINITY, NULL, NULL, 0, 0 },
    { 3, TG_F64, TG_OUTPUT, TG_READ_ONLY, "work", "J", "Work done by feet", -INFINITY, INFINITY, NULL, NULL, 0, 0 },
};
static tg_variable listed[4];
static size_t variables(void *self, const tg_variable **first) {
    (void)self;
    memcpy(listed, VARIABLES, sizeof listed);
    if (BROKEN(SAME_NAME)) listed[3].name = "deepest";
    if (BROKEN(ODD_UNIT)) listed[2].unit = "metres";
    if (BROKEN(RANGE_UPSIDE_DOWN)) listed[1].min = 3.0;
    if (BROKEN(NARROW_RANGE)) listed[2].max = 1e-3;
    *first = listed;
    return 4;
}
static double *place(soil *s, uint32_t id) {
    return id == 0 ? &s->k : id == 1 ? &s->mu : id == 2 ? &state_of(s)->deepest : id == 3 ? &state_of(s)->work : NULL;
}
static tg_status get(void *self, const tg_values *v) {
    soil *s = self;
    if (v->value_type != TG_F64 && !(BROKEN(ANY_TYPE) && v->value_type == TG_I32)) return fail(s->error, "all values are doubles"), TG_REFUSED;
    for (uint32_t i = 0; i < v->n_ids; i++) {
        double *from = place(s, v->ids[i]);
        if (!from && BROKEN(ANY_ID)) from = &s->limit;
        if (!from) return fail(s->error, "no such variable"), TG_REFUSED;
        if (v->value_type == TG_F64) ((double *)v->data)[i] = *from; else ((int32_t *)v->data)[i] = 0;
    }
    return TG_OK;
}
static tg_status set(void *self, const tg_values *v) {
    soil *s = self;
    if (v->value_type != TG_F64) return fail(s->error, "all values are doubles"), TG_REFUSED;
    for (uint32_t i = 0; i < v->n_ids; i++) {
        double *to = place(s, v->ids[i]), value = ((const double *)v->data)[i];
        if (!to) return fail(s->error, "no such variable"), TG_REFUSED;
        if (v->ids[i] > 1 && !BROKEN(SETS_ALL)) return fail(s->error, "can only be read"), TG_REFUSED;
        const tg_variable *one = &VARIABLES[v->ids[i]];
        if (!(value >= one->min && value <= one->max) && !BROKEN(NO_RANGE)) return fail(s->error, "outside its range"), TG_REFUSED;
        if (BROKEN(NAN_ACCEPTED) && isnan(value)) continue;
        if (!BROKEN(SET_LOST)) *to = value;
    }
    return TG_OK;
}
static tg_status act(void *self, const char *action, const char *arguments) {
    soil *s = self;
    (void)arguments;
    if (BROKEN(ANY_ACTION)) return TG_OK;
    return fail(s->error, action[0] ? "no such action" : "an action without a name"), TG_REFUSED;
}
static tg_status energy(void *self, tg_energy *out) {
    soil *s = self;
    state *q = state_of(s);
    double stored = 0.0;
    for (uint32_t f = 0; f < q->n_feet; f++) stored += q->feet[f].stored;
    if (BROKEN(NO_STORE)) stored = 0.0;
    *out = (tg_energy){ .potential = stored, .dissipated = q->lost, .port_work = q->work };
    return TG_OK;
}
#ifdef WITH_FIELD
static tg_field field;
static size_t fields(void *self, const tg_field **first) {
    soil *s = self;
    uint32_t edge = s->size[0] > s->size[1] ? s->size[0] : s->size[1];
    field = (tg_field){ "height", "m", { s->origin[0], s->origin[1] }, s->spacing, { s->size[0], s->size[1] }, edge, 0 };
    *first = &field;
    return 1;
}
static tg_status field_tile(void *self, size_t number, uint32_t a, uint32_t b, tg_field_tile *out) {
    soil *s = self;
    if (number || a || b) return fail(s->error, "no such tile"), TG_REFUSED;
    *out = (tg_field_tile){ s->generation, TG_TILE_F64, 0, 1.0, s->surface, (size_t)s->size[0] * s->size[1] };
    return TG_OK;
}
#endif
static const char *last_error(void *self) { return self ? ((soil *)self)->error : failure; }

static const tg_subsystem table = {
    .size = sizeof table - (BROKEN(SHORT_TABLE) ? 8 : 0), .abi_major = TG_ABI_MAJOR, .abi_minor = TG_ABI_MINOR, .kind = TG_SOIL,
    .id = BROKEN(NO_ID) ? NULL : "broken-soil",
#ifdef BROKEN_OTHER_DESCRIPTION
    .description = "terraglue module\nname=another\nversion=1\nabi=2.0\n",
#elif !defined BROKEN_NO_SECTION
    .description = tg_description,
#endif
    .schema = schema, .instantiate = instantiate, .free = BROKEN(GARBAGE_TABLE) ? NULL : destroy, .capabilities = capabilities, .advance = advance,
    .last_error = last_error, .set_ports = set_ports, .solve_compatibility = solve_compatibility,
    .interface_jacobian = interface_jacobian, .commit = commit, .save_state = save_state, .restore_state = restore_state,
    .serialize = serialize, .deserialize = deserialize, .variables = variables, .get = get, .set = set, .act = act,
    .energy = energy,
#ifdef WITH_FIELD
    .fields = fields, .field_tile = field_tile,
#endif
};
const tg_subsystem *terraglue_subsystem(void) { return &table; }
