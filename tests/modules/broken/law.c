/* A law that is right, and with one switch wrong in one way: see defects.tsv. With BROKEN_KEEPS it remembers the largest
 * depth itself; that alone is no mistake. */
#include <math.h>
#include "terraglue.h"

#if BROKEN_OTHER_FUNCTIONS
TG_DESCRIBE("broken-law", "1.0.0", TG_IS("law") TG_CAN("pressure"));
#else
TG_DESCRIBE("broken-law", "1.0.0", TG_IS("law") TG_CAN("pressure shear"));
#endif

enum { N, K_PHI, C_PA, PHI, K_M };
#define SCHEMA TG_LAW_SCHEMA("broken-law", "A power law with the shear of Janosi and Hanamoto", \
    TG_NUMBER("n", "", "1.1", "exponent") "," TG_NUMBER("k_phi", "", "820e3", "modulus, N/m^(n+2)") "," \
    TG_NUMBER("c_pa", "Pa", "170", "cohesion") "," TG_NUMBER("phi_rad", "rad", "0.61", "angle of friction") "," \
    TG_NUMBER("K_m", "m", "0.018", "shear modulus"))
#define K_U 4e8

static double first_loading(const double *p, double z, double *slope) {
    double q = p[K_PHI] * pow(z, p[N]);
    *slope = p[N] * q / z;
#ifdef BROKEN_SLOPE_WITHOUT_EXPONENT
    *slope = q / z;
#endif
#ifdef BROKEN_PULLS
    q -= 50.0;
#endif
#ifdef BROKEN_FALLS
    if (z > 0.1) q = p[K_PHI] * pow(0.1, p[N]) * (1.1 - z), *slope = -p[K_PHI] * pow(0.1, p[N]);
#endif
#ifdef BROKEN_CARRIES_NOTHING
    q = 0.0, *slope = 0.0;
#endif
#ifdef BROKEN_KICKS
    q += 2e4;
#endif
#ifdef BROKEN_NAN_DEEP
    if (z > 0.2) q = sqrt(0.2 - z);
#endif
    return q;
}

static tg_status pressure(const tg_pressure_nodes *at, tg_pressure_answer *out) {
    const double *p = at->parameters;
    double share = 1.0;
    size_t n = at->n;
#ifdef BROKEN_COUNTS_CALLS
    static double calls;
    share += 1e-12 * calls++;
#endif
#ifdef BROKEN_FEELS_NEIGHBOURS
    if (n > 1) share += 1e-6;
#endif
#ifdef BROKEN_ENDS_BEFORE_THE_LAST
    if (n > 1) n--;
#endif
    for (size_t i = 0; i < n; i++) {
        double slope;
#ifdef BROKEN_KEEPS
        double z = at->depth[i], largest = at->state[i], k_u = K_U;
        out->state[i] = largest, out->permanent[i] = at->permanent[i];
#ifdef BROKEN_GAINS
        k_u = z < 0.9 * largest ? 0.2 * K_U : K_U;
#endif
        if (z > largest) {
            out->pressure[i] = share * first_loading(p, z, &slope), out->slope[i] = slope;
            out->state[i] = z, out->permanent[i] = fmax(z - out->pressure[i] / K_U, 0.0);
        } else {
            double elastic = -1.0;
            if (largest > 0.0) elastic = first_loading(p, largest, &slope) - k_u * (largest - z);
            out->pressure[i] = fmax(elastic, 0.0), out->slope[i] = elastic > 0.0 ? k_u : 0.0;
        }
#ifdef BROKEN_GAINS
        if (z < largest) out->pressure[i] = fmax(out->pressure[i], 0.5 * first_loading(p, largest, &slope) * (z > 0.0));
        out->state[i] = z > 0.0 ? out->state[i] : 0.0;
#endif
#ifdef BROKEN_WRITES_COMMITTED
        ((double *)at->state)[i] = out->state[i];
#endif
#ifdef BROKEN_PUSHES_ABOVE
        if (at->state[i] == 0.0 && z <= 0.0) out->pressure[i] = 10.0;
#endif
#ifdef BROKEN_OTHER_SURFACE
        if (z > largest) out->permanent[i] = 1.5 * z;
#endif
#ifdef BROKEN_STATE_WITHOUT_TIME
        out->state[i] = out->state[i] * 1.001 + 1e-6;
#endif
#ifdef BROKEN_FORGETS_STATE
        if (z > 0.02) out->state[i] = NAN;
#endif
#else
        out->pressure[i] = share * first_loading(p, at->depth[i], &slope), out->slope[i] = slope;
#endif
    }
#ifdef BROKEN_BEYOND_THE_END
    out->pressure[n] = 0.0;
#endif
#ifdef BROKEN_WRITES_DEPTHS
    if (n) ((double *)at->depth)[0] = 0.0;
#endif
    return TG_OK;
}

static tg_status shear(const tg_shear_nodes *at, tg_shear_answer *out) {
    const double *p = at->parameters, mu = tan(p[PHI]);
    for (size_t i = 0; i < at->n; i++) {
        double strength = p[C_PA] + mu * at->pressure[i], mobilised = -expm1(-at->slip[i] / p[K_M]);
        out->stress[i] = strength * mobilised;
        out->by_pressure[i] = mu * mobilised;
        out->by_slip[i] = strength * (1.0 - mobilised) / p[K_M];
#ifdef BROKEN_SHEAR_SLOPE
        out->by_slip[i] *= 0.99;
#endif
#ifdef BROKEN_SHEAR_BY_PRESSURE
        out->by_pressure[i] = mu;
#endif
#ifdef BROKEN_SHEAR_SOFTENS
        double peak = 1.0 + 0.5 * exp(-at->slip[i] / 0.05);
        out->stress[i] *= peak, out->by_pressure[i] *= peak;
        out->by_slip[i] = out->by_slip[i] * peak - strength * mobilised * 0.5 * exp(-at->slip[i] / 0.05) / 0.05;
#endif
#ifdef BROKEN_SHEAR_WITHOUT_END
        out->stress[i] = strength * at->slip[i] / p[K_M], out->by_pressure[i] = mu * at->slip[i] / p[K_M];
        out->by_slip[i] = strength / p[K_M];
#endif
#ifdef BROKEN_HALF_FRICTION
        out->stress[i] *= 0.5, out->by_pressure[i] *= 0.5, out->by_slip[i] *= 0.5;
#endif
    }
    return TG_OK;
}

#ifdef BROKEN_KEEPS
#define DOUBLES 1
#elif defined(BROKEN_TOO_MUCH_STATE)
#define DOUBLES 17
#else
#define DOUBLES 0
#endif
#ifdef BROKEN_NO_FUNCTIONS
TG_EXPORT_LAW("broken-law", SCHEMA, DOUBLES, 0, 0)
#else
TG_EXPORT_LAW("broken-law", SCHEMA, DOUBLES, pressure, shear)
#endif
