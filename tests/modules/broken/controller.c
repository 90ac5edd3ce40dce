/* broken-controller: a way to a set-point, with a switch for every mistake that the checker must find. */
#include "broken.h"

TG_DESCRIBE("broken-controller", "1.0.0", TG_IS("controller") TG_CAN("force retry state")
    TG_HAS("set_point", "input", "f64", "rad")
    TG_HAS("angle_target", "output", "f64", "rad")
    TG_HAS("speed_target", "output", "f64", "rad/s")
    TG_HAS("time_constant", "parameter", "f64", "s"));
typedef struct { double target, speed, set_point, time_constant; } state; /* rad, rad/s, rad, s */
typedef struct {
    double limit;
    state now, next, *slots; /* committed; last trial; saved */
    uint32_t n_slots;
    tg_variable variables[4];
    char error[160];
} controller;
static tg_status refuse(char *to, const char *why) { fail(to, why); return TG_REFUSED; }

#define PARAMETER(name, unit, value, rule, help) "{\"name\":\"" name "\",\"type\":\"number\",\"unit\":\"" unit \
    "\",\"default\":" value rule ",\"help\":\"" help "\"}"
#define ABOVE_ZERO ",\"min\":0.0,\"above_min\":true"
static const char *schema(void) {
    return "{\"name\":\"broken-controller\",\"kind\":\"controller\",\"help\":\"A smooth way to a set-point, in C\",\"parameters\":["
        PARAMETER("set_point_rad", "rad", "0.4", "", "Set-point at the start") ","
        PARAMETER("time_constant_s", "s", "0.1", ABOVE_ZERO, "Time constant") ","
        PARAMETER("limit_rad", "rad", "1.5", ABOVE_ZERO, "Largest set-point, either way") "]}";
}
static void destroy(void *self) { free(((controller *)self)->slots); free(self); }
static tg_status instantiate(const tg_host *host, const char *config, void **self) {
    controller *c = calloc(1, sizeof *c);
    if (!c) return refuse(failure, "no memory");
    c->now.set_point = number(config, "\"set_point_rad\""), c->now.time_constant = number(config, "\"time_constant_s\"");
    c->limit = number(config, "\"limit_rad\"");
    c->slots = calloc(host->slots, sizeof *c->slots), c->n_slots = host->slots;
    if (!c->slots || !(c->now.time_constant > 0.0 && fabs(c->now.set_point) <= c->limit)) {
        destroy(c);
        return refuse(failure, "the time constant must be larger than zero, the set-point inside the limit");
    }
    /* id, type, role, effect, name, unit, help, range */
    c->variables[0] = (tg_variable){ 0, TG_F64, TG_INPUT, TG_LIVE, "set_point", "rad", "Where to go", -c->limit, c->limit, NULL, NULL, 0, 0 };
    c->variables[1] = (tg_variable){ 1, TG_F64, TG_OUTPUT, TG_READ_ONLY, "angle_target", "rad", "Target for a motor", -10.0 * c->limit, 10.0 * c->limit, NULL, NULL, 0, 0 };
    c->variables[2] = (tg_variable){ 2, TG_F64, TG_OUTPUT, TG_READ_ONLY, "speed_target", "rad/s", "Its rate of change", -INFINITY, INFINITY, NULL, NULL, 0, 0 };
    c->variables[3] = (tg_variable){ 3, TG_F64, TG_PARAMETER, TG_LIVE, "time_constant", "s", "Time constant", 1e-6, 1e6, NULL, NULL, 0, 0 };
    *self = c;
    return TG_OK;
}
static uint32_t capabilities(void *self) { (void)self; return TG_CAN_FORCE | TG_CAN_RETRY | TG_CAN_STATE; }

/* THE CONTROL LAW over h seconds: target'' = (set_point - target)/T^2 - 2 target'/T, solved exactly. */
static state control(state s, double h) {
    double away = s.target - s.set_point, left = exp(-h / s.time_constant), slope = s.speed + away / s.time_constant;
    s.target = s.set_point + (away + slope * h) * left;
    s.speed = (slope - (away + slope * h) / s.time_constant) * left;
    return s;
}

static tg_status advance(void *self, const tg_step *st, const tg_input *in, tg_response *out) {
    controller *c = self;
    (void)in, (void)out; /* no ports: nothing comes in or goes out here */
    c->next = control(c->now, BROKEN(COUNTS_CALLS) ? 1e-3 : st->h);
    if (BROKEN(NAN_AFTER_AN_HOUR) && st->t > 3600.0) c->next.target = NAN;
    if (BROKEN(LEAVES_ITS_RANGE)) c->next.target *= 1.5;
    if (BROKEN(TRIES_FOR_REAL)) c->now.target = c->next.target;
    return TG_OK;
}
static tg_status commit(void *self, const tg_step *st, const double *t, const tg_motion *partner) {
    (void)st, (void)t, (void)partner;
    controller *c = self;
    c->now = c->next;
    return TG_OK;
}
static tg_status save_state(void *self, uint32_t slot) {
    controller *c = self;
    if (slot >= c->n_slots) return refuse(c->error, "no such slot");
    c->slots[slot] = c->now;
    return TG_OK;
}
static tg_status restore_state(void *self, uint32_t slot) {
    controller *c = self;
    if (slot >= c->n_slots) return refuse(c->error, "no such slot");
    c->now = c->slots[slot];
    return TG_OK;
}

static size_t variables(void *self, const tg_variable **first) { *first = ((controller *)self)->variables; return 4; }
static double *place(controller *c, uint32_t id) {
    double *all[] = { &c->now.set_point, &c->now.target, &c->now.speed, &c->now.time_constant };
    return id < 4 ? all[id] : NULL;
}
static tg_status get(void *self, const tg_values *v) {
    controller *c = self;
    if (v->value_type != TG_F64) return refuse(c->error, "all values are doubles");
    for (uint32_t i = 0; i < v->n_ids; i++) {
        if (!place(c, v->ids[i])) return refuse(c->error, "no such variable");
        ((double *)v->data)[i] = *place(c, v->ids[i]);
    }
    return TG_OK;
}
static tg_status set(void *self, const tg_values *v) {
    controller *c = self;
    if (v->value_type != TG_F64) return refuse(c->error, "all values are doubles");
    for (uint32_t i = 0; i < v->n_ids; i++) {
        double value = ((const double *)v->data)[i];
        if (!place(c, v->ids[i])) return refuse(c->error, "no such variable");
        const tg_variable *one = &c->variables[v->ids[i]];
        if (one->effect == TG_READ_ONLY) return refuse(c->error, "an output can only be read");
        if (!(value >= one->min && value <= one->max)) return refuse(c->error, "outside the range of the variable");
        *place(c, v->ids[i]) = value;
    }
    return TG_OK;
}
static const char *last_error(void *self) { return self ? ((controller *)self)->error : failure; }

static const tg_subsystem table = {
    .size = sizeof table, .abi_major = TG_ABI_MAJOR, .abi_minor = TG_ABI_MINOR, .kind = TG_CONTROLLER,
    .id = "broken-controller", .description = tg_description, .schema = schema, .instantiate = instantiate,
    .free = destroy, .capabilities = capabilities, .advance = advance, .last_error = last_error,
    .commit = commit, .save_state = save_state, .restore_state = restore_state, .variables = variables,
    .get = get, .set = set,
};
const tg_subsystem *terraglue_subsystem(void) { return &table; }
