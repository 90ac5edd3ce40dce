/* Bekker's pressure and the shear of Janosi and Hanamoto as a law of its own, for comparison with the built-in one.
 * With -DKEEPS it remembers the largest depth itself and answers for unloading, as the host does for a law without state.
 * With -DSHORT it wants steps of at most a quarter of a millisecond. */
#include <math.h>
#include "terraglue.h"

TG_DESCRIBE("law-bekker-c", "1.0.0", TG_IS("law") TG_CAN("pressure shear"));

enum { N, K_C, K_PHI, C_PA, PHI, K_M, K_U };
#define SCHEMA TG_LAW_SCHEMA("law-bekker-c", "Bekker's pressure and the shear of Janosi and Hanamoto, in C", \
    TG_NUMBER("n", "", "1.0", "exponent") "," TG_NUMBER("k_c", "", "1400", "cohesive modulus, N/m^(n+1)") "," \
    TG_NUMBER("k_phi", "", "820e3", "frictional modulus, N/m^(n+2)") "," TG_NUMBER("c_pa", "Pa", "170", "cohesion") "," \
    TG_NUMBER("phi_rad", "rad", "0.61", "angle of friction") "," TG_NUMBER("K_m", "m", "0.018", "shear modulus") "," \
    TG_NUMBER("elastic_stiffness_pa_m", "Pa/m", "4e8", "stiffness of unloading"))

static double first_loading(const double *p, double b, double z, double *slope) {
    double pressure = (p[K_C] / b + p[K_PHI]) * pow(z, p[N]);
    *slope = p[N] * pressure / z;
    return pressure;
}

#ifdef KEEPS
static tg_status pressure(const tg_pressure_nodes *at, tg_pressure_answer *out) {
    const double *p = at->parameters;
    for (size_t i = 0; i < at->n; i++) {
        /* state: the largest depth; loose material that came to the node since leaves less of the hollow */
        double z = at->depth[i], largest = at->state[i], at_largest = 0.0, slope;
        if (largest > 0.0) at_largest = first_loading(p, at->b, largest, &slope);
        out->state[i] = largest, out->permanent[i] = at->permanent[i];
        if (z > largest) {
            out->pressure[i] = first_loading(p, at->b, z, &out->slope[i]);
            out->state[i] = z, out->permanent[i] = fmax(z - out->pressure[i] / p[K_U], 0.0);
        } else {
            double elastic = at_largest - p[K_U] * (largest - z);
            out->pressure[i] = fmax(elastic, 0.0), out->slope[i] = elastic > 0.0 ? p[K_U] : 0.0;
        }
    }
    return TG_OK;
}
#define DOUBLES 1
#else
static tg_status pressure(const tg_pressure_nodes *at, tg_pressure_answer *out) {
    for (size_t i = 0; i < at->n; i++)
        out->pressure[i] = first_loading(at->parameters, at->b, at->depth[i], &out->slope[i]);
#ifdef SHORT
    out->longest = 0.25e-3;
#endif
    return TG_OK;
}
#define DOUBLES 0
#endif

static tg_status shear(const tg_shear_nodes *at, tg_shear_answer *out) {
    const double *p = at->parameters, mu = tan(p[PHI]);
    for (size_t i = 0; i < at->n; i++) {
        double strength = p[C_PA] + mu * at->pressure[i], mobilised = -expm1(-at->slip[i] / p[K_M]);
        out->stress[i] = strength * mobilised;
        out->by_pressure[i] = mu * mobilised;
        out->by_slip[i] = strength * (1.0 - mobilised) / p[K_M];
    }
    return TG_OK;
}

TG_EXPORT_LAW("law-bekker-c", SCHEMA, DOUBLES, pressure, shear)
