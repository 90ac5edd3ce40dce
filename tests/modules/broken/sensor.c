/* broken-sensor: a range finder that looks down, with a switch for every mistake that the checker must find. */
#include "broken.h"

TG_DESCRIBE("broken-sensor", "1.0.0", TG_IS("sensor") TG_CAN("retry sees") TG_HAS("distance", "output", "f64", "m"));
typedef struct {
    double distance, time;
    const tg_world *kept; /* only where it is broken */
    char message[64];
    uint32_t calls;
} sensor;

static int made; /* instances of this process */
static const char *schema(void) {
    return "{\"name\":\"broken-sensor\",\"kind\":\"sensor\",\"help\":\"Looks down\",\"parameters\":[]}";
}
static tg_status instantiate(const tg_host *host, const char *config, void **self) {
    (void)host, (void)config;
    sensor *s = calloc(1, sizeof *s);
    if (!s) return fail(failure, "no memory");
    if (BROKEN(OTHER_VIEW)) s->distance = 1e-9 * ++made;
    *self = s;
    return TG_OK;
}
static uint32_t capabilities(void *self) { (void)self; return TG_CAN_RETRY | TG_CAN_SEE; }
static const char *last_error(void *self) { (void)self; return failure; }
static tg_status advance(void *self, const tg_step *st, const tg_input *in, tg_response *out) {
    (void)self, (void)st, (void)in, (void)out;
    return TG_OK;
}
static double look(const tg_world *world, double time) {
    tg_ray ray = { { 0, 0, 2 }, { 0, 0, -1 }, time, 10.0 };
    tg_ray_mask mask = { TG_SEES_SHAPES | TG_SEES_GROUND, UINT32_MAX, { UINT32_MAX, UINT32_MAX } };
    tg_ray_hit hit = { 0 };
    return world->cast_rays(world->ctx, 1, &ray, &mask, &hit) == TG_OK && hit.distance < 10.0 ? hit.distance : 10.0;
}
static tg_status commit(void *self, const tg_step *st, const double *t, const tg_motion *partner) {
    sensor *s = self;
    (void)t, (void)partner;
    if (BROKEN(KEEPS_WORLD) && s->kept) s->distance = look(s->kept, st->t);
    return TG_OK;
}
static tg_status observe(void *self, const tg_step *st, const tg_world *world) {
    sensor *s = self;
    double seen = look(world, world->interval[1] + (BROKEN(READS_FUTURE) ? st->h : 0.0));
    s->distance = BROKEN(OTHER_VIEW) ? seen + s->distance : seen;
    s->kept = BROKEN(KEEPS_WORLD) ? world : NULL;
    if (BROKEN(FLOODS) || s->calls++ % 10 == 0) s->time = world->interval[1];
    return TG_OK;
}
static const tg_variable distance = { 0, TG_F64, TG_OUTPUT, TG_READ_ONLY, "distance", "m", "Of the surface below", 0, 100, NULL, NULL, 0, 0 };
static size_t variables(void *self, const tg_variable **first) { (void)self; return *first = &distance, 1; }
static tg_status get(void *self, const tg_values *v) {
    if (v->value_type != TG_F64) return fail(failure, "it is a double"), TG_REFUSED;
    for (uint32_t i = 0; i < v->n_ids; i++) {
        if (v->ids[i] != 0) return fail(failure, "there is no such variable"), TG_REFUSED;
        ((double *)v->data)[i] = ((sensor *)self)->distance;
    }
    return TG_OK;
}
static tg_status set(void *self, const tg_values *v) { (void)self, (void)v; return fail(failure, "nothing can be set"), TG_REFUSED; }
static const tg_stream stream_info = { "range", "test.Range", "json", "The distance", 10.0, 64, 0 };
static size_t streams(void *self, const tg_stream **first) { (void)self; return *first = &stream_info, 1; }
static tg_status stream(void *self, size_t k, tg_message *out) {
    sensor *s = self;
    if (k != 0) return fail(failure, "there is no such stream"), TG_REFUSED;
    if (s->time == 0.0) return TG_OK;
    out->size = snprintf(s->message, sizeof s->message, "{\"distance\":%.6f}", s->distance);
    out->time = s->time, out->bytes = (const uint8_t *)s->message, out->is_there = 1;
    return TG_OK;
}

const tg_subsystem *terraglue_subsystem(void) {
    static const tg_subsystem table = {
        .size = sizeof table, .abi_major = TG_ABI_MAJOR, .abi_minor = TG_ABI_MINOR, .kind = TG_SENSOR, .id = "broken-sensor",
        .description = tg_description, .schema = schema, .instantiate = instantiate, .free = free, .capabilities = capabilities,
        .advance = advance, .last_error = last_error, .commit = commit, .variables = variables, .get = get, .set = set,
        .observe = observe, .streams = streams, .stream = stream };
    return &table;
}
