/* A component for tests: in each servo period it writes the positions of its pins, as doubles, to the file that TRACE_OUT
   names. SPDX-License-Identifier: MIT */
#include <stdio.h>
#include <stdlib.h>

#include "rtapi.h"
#include "rtapi_app.h"
#include "hal.h"

MODULE_LICENSE("GPL");

static int joints = 1;
RTAPI_MP_INT(joints, "number of pins");

static int component;
static hal_float_t **pins;
static FILE *out;

static void trace(void *arg, long period)
{
    (void)arg;
    (void)period;
    for (int i = 0; i < joints; i++) {
        const double position = *pins[i];
        (void)fwrite(&position, sizeof position, 1, out);
    }
}

int rtapi_app_main(void)
{
    int result = 0;
    component = hal_init("kinegen_trace");
    out = fopen(getenv("TRACE_OUT"), "wb");
    pins = hal_malloc((long)sizeof *pins * joints);
    if ((component < 0) || !out || !pins) {
        return -1;
    }
    for (int i = 0; i < joints; i++) {
        result |= hal_pin_float_newf(HAL_IN, &pins[i], component, "kinegen_trace.%d", i);
    }
    result |= hal_export_funct("kinegen_trace", trace, NULL, 1, 0, component);
    hal_ready(component);
    return result;
}

void rtapi_app_exit(void)
{
    fclose(out);
    hal_exit(component);
}
