/* broken-robot: a falling ball, with a switch for every mistake that the checker must find. */
#include "broken.h"

TG_DESCRIBE("broken-robot", "1.0.0", TG_IS("robot") TG_CAN("force estimate derivatives retry state"));
enum { X, Y, Z };
typedef struct { double position[3], velocity[3], work; } state; /* world, m, m/s, J */
typedef struct {
    double mass, radius, gravity[3];
    state now, next, *slots; /* committed; last trial; saved */
    uint32_t n_slots;
    tg_body body;
    tg_shape shape;
    char error[160];
} robot;
static tg_status refuse(char *to, const char *why) { fail(to, why); return TG_REFUSED; }

#define PARAMETER(name, unit, value, rule, help) "{\"name\":\"" name "\",\"type\":\"number\",\"unit\":\"" unit \
    "\",\"default\":" value rule ",\"help\":\"" help "\"}"
#define ABOVE_ZERO ",\"min\":0.0,\"above_min\":true"
static const char *schema(void) {
    return "{\"name\":\"broken-robot\",\"kind\":\"robot\",\"help\":\"A ball that falls and rests, in C\",\"parameters\":["
        PARAMETER("mass_kg", "kg", "5.0", ABOVE_ZERO, "Mass") "," PARAMETER("radius_m", "m", "0.05", ABOVE_ZERO, "Radius") ","
        PARAMETER("height_m", "m", "0.06", "", "Height of the centre at the start") ","
        PARAMETER("speed_m_s", "m/s", "0.0", "", "Speed along x at the start") "]}";
}
static void destroy(void *self) { free(((robot *)self)->slots); free(self); }
static tg_status instantiate(const tg_host *host, const char *config, void **self) {
    robot *r = calloc(1, sizeof *r);
    if (!r) return refuse(failure, "no memory");
    r->mass = number(config, "\"mass_kg\""), r->radius = number(config, "\"radius_m\"");
    r->now.position[Z] = number(config, "\"height_m\""), r->now.velocity[X] = number(config, "\"speed_m_s\"");
    memcpy(r->gravity, host->gravity, sizeof r->gravity);
    r->slots = calloc(host->slots, sizeof *r->slots), r->n_slots = host->slots;
    if (!r->slots || !(r->mass > 0.0 && r->radius > 0.0) || isnan(r->now.position[Z] + r->now.velocity[X])) {
        destroy(r);
        return refuse(failure, "mass and radius must be larger than zero, height and speed numbers");
    }
    r->body = (tg_body){ "ball", r->mass };
    r->shape = (tg_shape){ .geometry = TG_SPHERE, .collides = 1, .name = "ball", .size = { r->radius },
                           .body_from_shape = { .orientation = { 1.0 } } };
    *self = r;
    return TG_OK;
}
static uint32_t capabilities(void *self) {
    (void)self;
    return TG_CAN_FORCE | TG_CAN_ESTIMATE | TG_CAN_DERIVATIVES | TG_CAN_RETRY | TG_CAN_STATE;
}

/* THE MOTION: velocity (m/s) after h seconds under a force (N, world). */
static void move(const robot *r, const double force[3], double h, double velocity[3]) {
    for (int k = 0; k < 3; k++) velocity[k] = r->now.velocity[k] + h * (r->gravity[k] + force[k] / r->mass);
    if (BROKEN(FALLS_SLOWLY)) velocity[Z] = r->now.velocity[Z] + h * (0.9 * r->gravity[Z] + force[Z] / r->mass);
    if (BROKEN(OWN_GRAVITY)) velocity[Z] = r->now.velocity[Z] + h * (-9.81 + force[Z] / r->mass);
    if (BROKEN(HALF_THE_FORCE)) velocity[X] = r->now.velocity[X] + h * 0.5 * force[X] / r->mass;
    if (BROKEN(FORCE_LIMIT) && fabs(force[Z]) > 5e3) velocity[Z] = NAN;
    if (BROKEN(GAINS_SPEED)) velocity[X] += 0.05 * h * 9.81;
}

/* World direction of component c of a port; the ball does not turn, so moments do nothing. */
static const double still[3] = { 0.0 };
static const double *direction(const tg_port *p, uint32_t c) { return c < 3 ? p->frame + 3 * c : still; }
static tg_status set_ports(void *self, const tg_step *st, tg_law *laws, tg_response *now) {
    robot *r = self;
    (void)laws; /* friction is the ground's business */
    for (uint32_t p = 0; p < st->n_ports; p++) {
        for (uint32_t c = 0, i = st->ports[p].first; c < 6; c++) {
            if (!(st->ports[p].mask >> c & 1)) continue;
            now->x[i] = now->a[i] = now->t[i] = 0.0, now->v[i++] = dot(direction(&st->ports[p], c), r->now.velocity);
        }
    }
    return TG_OK;
}
static tg_status advance(void *self, const tg_step *st, const tg_input *in, tg_response *out) {
    robot *r = self;
    double force[3] = { 0.0, 0.0, 0.0 };
    if (in->kind != TG_FORCE) return TG_UNSUPPORTED;
    for (uint32_t p = 0; p < st->n_ports; p++)
        for (uint32_t c = 0, i = st->ports[p].first; c < 6; c++) {
            if (!(st->ports[p].mask >> c & 1)) continue;
            for (int k = 0; k < 3; k++) force[k] += st->ports[p].side * in->t[i] * direction(&st->ports[p], c)[k];
            i++;
        }
    r->next = r->now;
    move(r, force, st->h, r->next.velocity);
    for (int k = 0; k < 3; k++) r->next.position[k] += st->h * r->next.velocity[k];
    for (uint32_t p = 0; p < st->n_ports; p++)
        for (uint32_t c = 0, i = st->ports[p].first; c < 6; c++) {
            if (!(st->ports[p].mask >> c & 1)) continue;
            const double *d = direction(&st->ports[p], c);
            out->v[i] = dot(d, r->next.velocity), out->x[i] = st->h * out->v[i], out->t[i] = in->t[i];
            out->a[i++] = dot(d, r->gravity) + dot(d, force) / r->mass;
            r->next.work += out->t[i - 1] * st->ports[p].side * out->x[i - 1];
        }
    return TG_OK;
}
/* dX/dT = h^2/m, dV/dT = h/m, dA/dT = 1/m, along the angle between the directions. */
static tg_status interface_jacobian(void *self, const tg_step *st, uint32_t level, double *out) {
    robot *r = self;
    if (level > TG_ACCELERATION) return TG_UNSUPPORTED;
    double share = (level == TG_POSITION ? st->h * st->h : level == TG_VELOCITY ? st->h : 1.0) / r->mass;
    for (uint32_t p = 0; p < st->n_ports; p++)
        for (uint32_t c = 0, i = st->ports[p].first; c < 6; c++) {
            if (!(st->ports[p].mask >> c & 1)) continue;
            for (uint32_t q = 0; q < st->n_ports; q++)
                for (uint32_t e = 0, j = st->ports[q].first; e < 6; e++)
                    if (st->ports[q].mask >> e & 1)
                        out[(size_t)st->n * j++ + i] = share * dot(direction(&st->ports[p], c), direction(&st->ports[q], e));
            i++;
        }
    if (BROKEN(LOPSIDED) && st->n > 1) out[1] += 0.1 * out[0];
    if (BROKEN(WRONG_COMPLIANCE)) for (uint32_t k = 0; k < st->n * st->n; k++) out[k] *= 1.05;
    if (BROKEN(NEGATIVE_COMPLIANCE)) for (uint32_t k = 0; k < st->n * st->n; k++) out[k] = -out[k];
    return TG_OK;
}
/* T*: the force that stops the ball at the partner at t + h. Several ports share it. */
static tg_status estimate_forces(void *self, const tg_step *st, const tg_motion *partner, tg_estimate *out) {
    robot *r = self;
    double free_velocity[3], none[3] = { 0.0, 0.0, 0.0 };
    move(r, none, st->h, free_velocity);
    for (uint32_t p = 0; p < st->n_ports; p++) {
        const tg_port *port = &st->ports[p];
        double per_metre = r->mass / (st->h * st->h * st->n_ports), slip = 0.0;
        for (uint32_t c = 0, i = port->first; c < 6; c++) {
            if (!(port->mask >> c & 1)) continue;
            out->x_free[i] = st->h * dot(direction(port, c), free_velocity);
            out->t_star[i] = c < 3 ? per_metre * (partner->x[i] - out->x_free[i]) : 0.0;
            if (c > 0) slip = hypot(slip, out->t_star[i]);
            i++;
        }
        double *t = out->t_star + port->first;
        t[0] = BROKEN(ESTIMATE_PULLS) ? t[0] : fmax(t[0], 0.0);
        if (BROKEN(HALF_THE_ESTIMATE)) t[0] *= 0.5;
        if (BROKEN(ALWAYS_ESTIMATES)) t[0] = r->mass * 9.81;
        out->active[p] = t[0] > 0.0;
        double bound = port->law.mu * t[0], share = slip > bound ? bound / slip : 1.0;
        for (uint32_t c = 1; c < (uint32_t)__builtin_popcount(port->mask); c++) t[c] = t[0] > 0.0 ? t[c] * share : 0.0;
    }
    out->unique = st->n_ports < 2;
    return interface_jacobian(self, st, TG_POSITION, out->g);
}
static tg_status commit(void *self, const tg_step *st, const double *t, const tg_motion *partner) {
    (void)st, (void)t, (void)partner; /* the last trial was under t */
    robot *r = self;
    r->now = r->next;
    return TG_OK;
}
static tg_status save_state(void *self, uint32_t slot) {
    robot *r = self;
    if (slot >= r->n_slots) return refuse(r->error, "no such slot");
    r->slots[slot] = r->now;
    if (BROKEN(SAVES_NO_SPEED)) r->slots[slot].velocity[Z] = 0.0;
    return TG_OK;
}
static tg_status restore_state(void *self, uint32_t slot) {
    robot *r = self;
    if (slot >= r->n_slots) return refuse(r->error, "no such slot");
    r->now = r->slots[slot];
    return TG_OK;
}

static tg_status scene(void *self, tg_scene *out) {
    robot *r = self;
    *out = (tg_scene){ &r->body, &r->shape, 1, 1 };
    return TG_OK;
}
static tg_status body_states(void *self, size_t n, tg_body_state *out) {
    robot *r = self;
    if (n != 1) return refuse(r->error, "there is one body");
    *out = (tg_body_state){ .world_from_body = { .orientation = { 1.0 } } };
    memcpy(out->world_from_body.position, r->now.position, sizeof r->now.position);
    memcpy(out->linear_velocity, r->now.velocity, sizeof r->now.velocity);
    if (BROKEN(SHOWS_OTHER_SPEED)) out->linear_velocity[Z] *= 3.0;
    if (BROKEN(LONG_QUATERNION)) out->world_from_body.orientation[0] = 1.0 + 1e-3 * r->now.velocity[Z];
    return TG_OK;
}
static tg_status energy(void *self, tg_energy *out) {
    robot *r = self;
    double kinetic = 0.5 * r->mass * dot(r->now.velocity, r->now.velocity);
    if (BROKEN(ENERGY_SIGN)) kinetic *= 3.0;
    *out = (tg_energy){ .kinetic = kinetic, .potential = -r->mass * dot(r->gravity, r->now.position), .port_work = r->now.work };
    return TG_OK;
}
static const char *last_error(void *self) { return self ? ((robot *)self)->error : failure; }

static const tg_subsystem table = {
    .size = sizeof table, .abi_major = TG_ABI_MAJOR, .abi_minor = TG_ABI_MINOR, .kind = TG_ROBOT,
    .id = "broken-robot", .description = tg_description, .schema = schema, .instantiate = instantiate,
    .free = destroy, .capabilities = capabilities, .advance = advance, .last_error = last_error,
    .set_ports = set_ports, .estimate_forces = estimate_forces, .interface_jacobian = interface_jacobian,
    .commit = commit, .save_state = save_state, .restore_state = restore_state, .scene = scene,
    .body_states = body_states, .energy = energy,
};
const tg_subsystem *terraglue_subsystem(void) { return &table; }
