/* The logger of FMI 2.0 is variadic: its text is formatted here and handed on as one string. */
#include <stdarg.h>
#include <stdio.h>

void terraglue_fmi_log(void *environment, const char *instance, int status, const char *category, const char *text);

void terraglue_fmi2_logger(void *environment, const char *instance, int status, const char *category,
                           const char *message, ...) {
    char text[4096];
    va_list arguments;
    if (!message) {
        terraglue_fmi_log(environment, instance, status, category, 0);
        return;
    }
    va_start(arguments, message);
    if (vsnprintf(text, sizeof text, message, arguments) < 0) {
        text[0] = '\0';
    }
    va_end(arguments);
    terraglue_fmi_log(environment, instance, status, category, text);
}
