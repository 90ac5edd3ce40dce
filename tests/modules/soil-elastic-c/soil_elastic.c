/* soil-elastic: ground in C that yields like a spring and holds the foot by friction.
 *
 * Each foot stands on a spring of its own: T_n = k z with z = (ground - origin) n_z - X_n, the depth below the
 * ground of the scenario, which this soil never changes. Along the tangents a second spring holds the foot
 * until it slides at mu T_n. A template for soils in C: it shows every call that both strategies need.
 * cc -std=c11 -O2 -fPIC -shared -I interfaces/plugin/include soil_elastic.c -o libsoil_elastic_plugin.so -lm */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "terraglue.h"

TG_DESCRIBE("soil-elastic", "1.0.0", TG_IS("soil") TG_CAN("force motion derivatives retry state"));
#define MAX_FEET 64

typedef struct { uint64_t key; double tangential[3]; } foot; /* committed friction on the body, world, N */
typedef struct { /* answer of a port in the last trial; x, t along n, t1, t2 */
    double x[3], t[3], trial; /* trial: size of the elastic friction where the foot slides, else 0, N */
    bool force, motion;
} answer;
typedef struct {
    double k, k_t, mu;
    double origin[2], spacing, *height; /* the ground; no heights: a plane at 0 */
    uint32_t size[2], n_feet, n_slots;
    foot feet[MAX_FEET], *slots; /* committed state, and n_slots copies of it */
    uint32_t *slot_count, of_port[MAX_FEET];
    answer last[MAX_FEET];
    char error[160];
} soil;
static char failure[160]; /* why the last instantiate failed */
static tg_status fail(char *to, const char *why) { snprintf(to, 160, "%s", why); return TG_ERROR; }

#define PARAMETER(name, unit, value, rule, help) "{\"name\":\"" name "\",\"type\":\"number\",\"unit\":\"" unit \
    "\",\"default\":" value "," rule ",\"help\":\"" help "\"}"
#define ABOVE_ZERO "\"min\":0.0,\"above_min\":true"
static const char *schema(void) {
    return "{\"name\":\"soil-elastic\",\"kind\":\"soil\",\"help\":\"Linear elastic ground with friction, in C\","
        "\"parameters\":[" PARAMETER("stiffness_n_m", "N/m", "20000.0", ABOVE_ZERO, "Stiffness below a foot")
        "," PARAMETER("tangential_n_m", "N/m", "20000.0", ABOVE_ZERO, "Stiffness of the grip along the ground")
        "," PARAMETER("mu", "", "0.7", "\"min\":0.0", "Coulomb coefficient") "]}";
}
/* The number of a key; the host sends every parameter of the schema, as it has a default. */
static double number(const char *json, const char *quoted_key) {
    const char *at = strstr(json, quoted_key);
    return at && (at = strchr(at, ':')) ? strtod(at + 1, NULL) : NAN;
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
    free(s->height); free(s->slots); free(s->slot_count); free(s);
}
static tg_status instantiate(const tg_host *host, const char *config, void **self) {
    soil *s = calloc(1, sizeof *s);
    if (!s) return fail(failure, "no memory");
    s->k = number(config, "\"stiffness_n_m\""), s->k_t = number(config, "\"tangential_n_m\"");
    s->mu = number(config, "\"mu\""), s->n_slots = host->slots;
    s->slots = calloc((size_t)host->slots * MAX_FEET, sizeof *s->slots);
    s->slot_count = calloc(host->slots, sizeof *s->slot_count);
    const tg_terrain *g = host->terrain;
    if (g && g->size[0] > 1 && g->size[1] > 1) {
        for (int a = 0; a < 2; a++) s->origin[a] = g->origin[a], s->size[a] = g->size[a];
        s->spacing = g->spacing;
        s->height = malloc((size_t)g->size[0] * g->size[1] * sizeof *s->height);
    }
    bool read = !g || (s->height && g->heights(g->ctx, 0, 0, s->size[0], s->size[1], s->height) >= 0);
    if (!s->slots || !s->slot_count || !read || !(s->k > 0.0 && s->k_t > 0.0 && s->mu >= 0.0)) {
        destroy(s);
        return fail(failure, "a parameter is missing, the terrain cannot be read, or there is no memory");
    }
    *self = s;
    return TG_OK;
}
static uint32_t capabilities(void *self) {
    (void)self; /* the same for all */
    return TG_CAN_FORCE | TG_CAN_MOTION | TG_CAN_DERIVATIVES | TG_CAN_RETRY | TG_CAN_STATE;
}

/* The law at X for a normal force (given, or NAN: that of the spring): fills the answer of a port. */
static void respond(const soil *s, const tg_port *p, const foot *f, const double x[3], double t_n, answer *a) {
    double z = depth(s, p);
    a->t[0] = isnan(t_n) ? fmax(s->k * (z - x[0]), 0.0) : t_n;
    a->x[0] = isnan(t_n) ? x[0] : z - t_n / s->k;
    for (int c = 1; c < 3; c++) {
        const double *d = p->frame + 3 * c;
        double before = d[0] * f->tangential[0] + d[1] * f->tangential[1] + d[2] * f->tangential[2];
        a->t[c] = before - s->k_t * x[c];
        a->x[c] = x[c];
    }
    double size = hypot(a->t[1], a->t[2]), bound = s->mu * fmax(a->t[0], 0.0);
    a->trial = size > bound ? size : 0.0;
    for (int c = 1; c < 3 && size > bound; c++) a->t[c] *= bound / size;
}
static void pack(const tg_port *p, const answer *a, tg_response *out) { /* moments are 0 */
    for (uint32_t c = 0, i = p->first; c < 6; c++) {
        if (!(p->mask >> c & 1)) continue;
        out->x[i] = c < 3 ? a->x[c] : 0.0, out->t[i] = c < 3 ? a->t[c] : 0.0;
        out->v[i] = out->a[i] = 0.0, i++;
    }
}

static const double still[3];
static tg_status set_ports(void *self, const tg_step *st, tg_law *laws, tg_response *now) {
    soil *s = self;
    for (uint32_t p = 0; p < st->n_ports; p++) {
        const tg_port *port = &st->ports[p];
        uint32_t f = 0;
        while (f < s->n_feet && s->feet[f].key != port->key) f++;
        if ((port->mask & 7) != 7) return fail(s->error, "a port does not carry n, t1 and t2");
        if (f == MAX_FEET) return fail(s->error, "more than 64 feet");
        if (f == s->n_feet) s->feet[s->n_feet++] = (foot){ .key = port->key };
        s->of_port[p] = f;
        respond(s, port, &s->feet[f], still, NAN, &s->last[p]);
        s->last[p].x[0] = fmin(depth(s, port), 0.0); /* the surface is at the foot, or below it by the gap */
        pack(port, &s->last[p], now);
        laws[p].mu = fmin(laws[p].mu, s->mu);
    }
    return TG_OK;
}
static tg_status advance(void *self, const tg_step *st, const tg_input *in, tg_response *out) {
    soil *s = self;
    for (uint32_t p = 0; p < st->n_ports; p++) {
        const tg_port *port = &st->ports[p];
        answer *a = &s->last[p];
        a->force = in->kind == TG_FORCE, a->motion = in->x != NULL;
        const double *t = a->force ? in->t + port->first : NULL, *x = a->motion ? in->x + port->first : still;
        respond(s, port, &s->feet[s->of_port[p]], x, t ? t[0] : NAN, a);
        for (int c = 1; c < 3 && t && !a->motion; c++) /* force alone: the spring yields until it carries it */
            a->x[c] = (a->t[c] - t[c]) / s->k_t, a->t[c] = t[c];
        pack(port, a, out);
    }
    return TG_OK; /* out->reached came as t + h */
}
static tg_status interface_jacobian(void *self, const tg_step *st, uint32_t level, double *out) {
    soil *s = self;
    if (level == TG_ACCELERATION) return TG_UNSUPPORTED;
    memset(out, 0, sizeof *out * st->n * st->n); /* nothing here depends on velocity */
    for (uint32_t p = 0; p < st->n_ports && level == TG_POSITION; p++) {
        const answer *a = &s->last[p];
        double v, bound = s->mu * a->t[0], slope = a->t[0] > 0.0 ? s->k : 0.0, d[3] = { 0.0, 0.0, 0.0 };
        double share = a->trial > 0.0 ? bound / a->trial : 1.0; /* 1: sticks; else it slides along d */
        for (int c = 1; c < 3 && a->trial > 0.0 && bound > 0.0; c++) d[c] = a->t[c] / bound;
        for (int e = 0; e < 9; e++) {
            int r = e % 3, c = e / 3;
            if (r == 0) v = c > 0 ? 0.0 : a->force ? 1.0 / s->k : slope;
            else if (a->force && !a->motion) v = r == c ? 1.0 / s->k_t : 0.0;
            else if (c == 0) v = s->mu * d[r] * (a->force ? 1.0 : slope);
            else v = s->k_t * share * ((r == c) - d[r] * d[c]);
            out[(size_t)(st->ports[p].first + c) * st->n + st->ports[p].first + r] = v;
        }
    }
    return TG_OK;
}
static tg_status commit(void *self, const tg_step *st, const double *t, const tg_motion *body) {
    soil *s = self;
    (void)t; /* the ground follows the foot, whatever T was */
    for (uint32_t p = 0; p < st->n_ports; p++) {
        const double *frame = st->ports[p].frame;
        foot *f = &s->feet[s->of_port[p]];
        answer a;
        respond(s, &st->ports[p], f, body->x + st->ports[p].first, NAN, &a);
        for (int k = 0; k < 3; k++) f->tangential[k] = frame[3 + k] * a.t[1] + frame[6 + k] * a.t[2];
    }
    return TG_OK;
}
static tg_status move_state(soil *s, uint32_t slot, bool save) {
    if (slot >= s->n_slots) return fail(s->error, "no such slot");
    foot *kept = s->slots + (size_t)slot * MAX_FEET;
    memcpy(save ? kept : s->feet, save ? s->feet : kept, sizeof s->feet);
    if (save) s->slot_count[slot] = s->n_feet; else s->n_feet = s->slot_count[slot];
    return TG_OK;
}
static tg_status save_state(void *self, uint32_t slot) { return move_state(self, slot, true); }
static tg_status restore_state(void *self, uint32_t slot) { return move_state(self, slot, false); }
static const char *last_error(void *self) { return self ? ((soil *)self)->error : failure; }

static const tg_subsystem table = {
    .size = sizeof table, .abi_major = TG_ABI_MAJOR, .abi_minor = TG_ABI_MINOR, .kind = TG_SOIL,
    .id = "soil-elastic", .description = tg_description, .schema = schema, .instantiate = instantiate,
    .free = destroy, .capabilities = capabilities, .advance = advance, .last_error = last_error,
    .set_ports = set_ports, .interface_jacobian = interface_jacobian, .commit = commit,
    .save_state = save_state, .restore_state = restore_state,
};
const tg_subsystem *terraglue_subsystem(void) { return &table; }
