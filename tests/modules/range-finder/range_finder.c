/* A range finder: the distance to the first surface along its axis x, to sit on a body that the scenario names. */
#include <stdlib.h>
#include <string.h>
#include "terraglue.h"

TG_DESCRIBE("my-range-finder", "1.0.0", TG_IS("sensor") TG_CAN("sees") TG_HAS("distance", "output", "f64", "m"));

typedef struct { char mount[128]; double range, distance; } finder;

static const char *schema(void) {
    return "{\"name\":\"my-range-finder\",\"kind\":\"sensor\",\"help\":\"Distance of the first surface\",\"parameters\":["
           "{\"name\":\"mount\",\"type\":\"text\",\"help\":\"Body that it sits on: SUBSYSTEM.BODY\"},"
           TG_NUMBER("range_m", "m", "10.0", "Farthest surface that it meets") "]}";
}
static const char *last_error(void *self) { (void)self; return "the body of `mount` is not there"; }
static uint32_t capabilities(void *self) { (void)self; return TG_CAN_SEE; }

static tg_status instantiate(const tg_host *host, const char *config, void **self) {
    (void)host;
    finder *f = calloc(1, sizeof *f);
    const char *mount = strstr(config, "\"mount\":\""), *range = strstr(config, "\"range_m\":");
    if (!f || !mount || !range || strcspn(mount + 9, "\"") >= sizeof f->mount) return free(f), TG_REFUSED;
    memcpy(f->mount, mount + 9, strcspn(mount + 9, "\""));
    f->distance = f->range = strtod(range + 10, NULL);
    *self = f;
    return TG_OK;
}

static tg_status advance(void *self, const tg_step *step, const tg_input *input, tg_response *out) {
    (void)self, (void)step, (void)input, (void)out;
    return TG_OK;
}

static tg_status observe(void *self, const tg_step *step, const tg_world *world) {
    finder *f = self;
    char *dot = strchr(f->mount, '.');
    tg_body_ref body;
    tg_body_state at;
    (void)step;
    if (!dot) return TG_ERROR;
    *dot = 0; /* the two names, for this call */
    tg_status found = world->body(world->ctx, f->mount, dot + 1, &body);
    *dot = '.';
    if (found != TG_OK || world->pose(world->ctx, body, world->interval[1], &at) != TG_OK) return TG_ERROR;
    const double *p = at.world_from_body.position, *q = at.world_from_body.orientation;
    tg_ray ray = { { p[0], p[1], p[2] },
                   { 1 - 2 * (q[2] * q[2] + q[3] * q[3]), 2 * (q[1] * q[2] + q[0] * q[3]), 2 * (q[1] * q[3] - q[0] * q[2]) },
                   world->interval[1], f->range };
    tg_ray_mask mask = { TG_SEES_SHAPES | TG_SEES_GROUND, UINT32_MAX, body };
    tg_ray_hit hit;
    if (world->cast_rays(world->ctx, 1, &ray, &mask, &hit) != TG_OK) return TG_ERROR;
    f->distance = hit.distance < f->range ? hit.distance : f->range;
    return TG_OK;
}

static const tg_variable distance = { 0, TG_F64, TG_OUTPUT, TG_READ_ONLY, "distance", "m", "Distance of the first surface",
                                      0, 1e9, NULL, NULL, 0, 0 };
static size_t variables(void *self, const tg_variable **first) { (void)self; return *first = &distance, 1; }
static tg_status get(void *self, const tg_values *values) {
    if (values->value_type != TG_F64 || values->n_ids != 1 || values->ids[0] != 0) return TG_REFUSED;
    *(double *)values->data = ((finder *)self)->distance;
    return TG_OK;
}

const tg_subsystem *terraglue_subsystem(void) {
    static const tg_subsystem table = {
        .size = sizeof table, .abi_major = TG_ABI_MAJOR, .abi_minor = TG_ABI_MINOR, .kind = TG_SENSOR, .id = "my-range-finder",
        .description = tg_description, .schema = schema, .instantiate = instantiate, .free = free, .advance = advance,
        .capabilities = capabilities, .last_error = last_error, .variables = variables, .get = get, .observe = observe };
    return &table;
}
