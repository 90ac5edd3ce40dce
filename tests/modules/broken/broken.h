/* Switches of the broken modules: -DBROKEN_NAN_ANSWER=1 makes BROKEN(NAN_ANSWER) true, all others are false. Without any
 * switch a module is the clean twin. tests/modules/broken/defects.tsv lists all switches with the test that must find each. */
#ifndef BROKEN_H
#define BROKEN_H
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "terraglue.h"

#define BROKEN_PAIR_1 0,
#define BROKEN_SECOND(a, b, ...) b
#define BROKEN_PICK(pair) BROKEN_SECOND(pair 1, 0, 0)
#define BROKEN_JOIN(value) BROKEN_PICK(BROKEN_PAIR_##value)
#define BROKEN_VALUE(value) BROKEN_JOIN(value)
#define BROKEN(name) BROKEN_VALUE(BROKEN_##name)

static char failure[160]; /* why the last instantiate failed */
__attribute__((unused)) static tg_status fail(char *to, const char *why) {
    snprintf(to, 160, "%s", why);
    return TG_ERROR;
}
/* The number of a key; the host sends every parameter of the schema, as it has a default. */
__attribute__((unused)) static double number(const char *json, const char *quoted_key) {
    const char *at = strstr(json, quoted_key);
    return at && (at = strchr(at, ':')) ? strtod(at + 1, NULL) : NAN;
}
__attribute__((unused)) static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
#endif
