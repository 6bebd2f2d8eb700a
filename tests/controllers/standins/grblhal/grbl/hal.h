/* A stand-in for grblHAL's header of the same name, written for tests: only what the emitted plug-in uses.
   SPDX-License-Identifier: MIT */
#ifndef STANDIN_HAL_H
#define STANDIN_HAL_H

#include <stdbool.h>
#include <stdint.h>

#define N_AXIS 4

typedef union {
    uint8_t mask;
} axes_signals_t;

typedef union {
    float values[N_AXIS];
} coord_data_t;

typedef union {
    int32_t values[N_AXIS];
} mpos_t;

typedef struct {
    float feed_rate;
} plan_line_data_t;

typedef enum { HomingMode_Seek, HomingMode_Locate } homing_mode_t;
typedef enum { Alarm_None, Alarm_SoftLimit } alarm_code_t;

typedef struct {
    float steps_per_mm;
} axis_settings_t;

typedef struct {
    axis_settings_t axis[N_AXIS];
} settings_t;

typedef struct {
    int32_t position[N_AXIS];
    float home_position[N_AXIS];
} system_t;

extern settings_t settings;
extern system_t sys;

void system_raise_alarm(alarm_code_t alarm);

#endif
