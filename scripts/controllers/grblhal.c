/* The mechanics of an arm below grblHAL's simulator: motors that count their own steps, and switches at their limits.
   SPDX-License-Identifier: MIT

   Compiled with the core and the simulator of a checkout by scripts/try_controllers.py, which wraps driver_init and
   plan_buffer_line.
   It reads the file `arm`: for each axis a line of the place where its motor is, and of its two switches, in steps.
   It writes the file `motors`: the time in seconds and the steps of all motors, every millisecond in which one moved. */
#include "driver.h"
#include "simulator.h"
#include "grbl/grbl.h"
#include "grbl/hal.h"
#include "grbl/planner.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

bool __real_driver_init(void);
bool __wrap_driver_init(void);
bool __real_plan_buffer_line(float *target, plan_line_data_t *plan);
bool __wrap_plan_buffer_line(float *target, plan_line_data_t *plan);
void my_plugin_init(void);

static int64_t at[N_AXIS], switches[N_AXIS][2];
static void (*pulse)(stepper_t *);
static FILE *motors;
static double written = -1.0;
static float planned[N_AXIS];

/* The planner rounds motors to steps; this is what it is given. */
bool __wrap_plan_buffer_line(float *target, plan_line_data_t *plan)
{
    memcpy(planned, target, sizeof planned);
    return __real_plan_buffer_line(target, plan);
}

static void count(stepper_t *stepper)
{
    bool moves = false;
    for (int i = 0; i < N_AXIS; i++) {
        if ((stepper->step_out.mask >> i) & 1) {
            at[i] += ((stepper->dir_out.mask >> i) & 1) ? -1 : 1;
            moves = true;
        }
    }
    const double now = (double)sim.masterclock / (double)F_CPU;
    if (moves && (now - written) >= 1e-3) {
        written = now;
        fprintf(motors, "%.6f", now);
        for (int i = 0; i < N_AXIS; i++) {
            fprintf(motors, " %lld", (long long)at[i]);
        }
        fputc('\n', motors);
    }
    pulse(stepper);
}

static home_signals_t switched(void)
{
    home_signals_t found = {0};
    for (int i = 0; i < N_AXIS; i++) {
        if ((at[i] <= switches[i][0]) || (at[i] >= switches[i][1])) {
            found.a.mask |= (uint8_t)(1U << i);
        }
    }
    return found;
}

/* The counts themselves, whatever grblHAL takes them for. */
static status_code_t say_motors(sys_state_t state, char *args)
{
    char text[32];
    (void)state;
    (void)args;
    fflush(motors);
    hal.stream.write("[MOTORS:");
    for (int i = 0; i < N_AXIS; i++) {
        snprintf(text, sizeof text, "%s%lld", (i == 0) ? "" : ",", (long long)at[i]);
        hal.stream.write(text);
    }
    hal.stream.write("]" ASCII_EOL);
    return Status_OK;
}

static status_code_t say_planned(sys_state_t state, char *args)
{
    char text[32];
    (void)state;
    (void)args;
    hal.stream.write("[PLANNED:");
    for (int i = 0; i < N_AXIS; i++) {
        snprintf(text, sizeof text, "%s%.9g", (i == 0) ? "" : ",", (double)planned[i]);
        hal.stream.write(text);
    }
    hal.stream.write("]" ASCII_EOL);
    return Status_OK;
}

bool __wrap_driver_init(void)
{
    static const sys_command_t list[] = {
        {"MOTORS", say_motors, {.noargs = On}, {.str = "steps of all motors"}},
        {"PLANNED", say_planned, {.noargs = On}, {.str = "motors at the end of the last block, before rounding"}},
    };
    static sys_commands_t commands = {.n_commands = 2, .commands = list};
    FILE *arm = fopen("arm", "r");
    for (int i = 0; (arm != NULL) && (i < N_AXIS); i++) {
        long long numbers[3];
        if (fscanf(arm, "%lld %lld %lld", &numbers[0], &numbers[1], &numbers[2]) != 3) {
            return false;
        }
        at[i] = numbers[0];
        switches[i][0] = numbers[1];
        switches[i][1] = numbers[2];
    }
    motors = fopen("motors", "w");
    const bool is_ready = __real_driver_init();
    pulse = hal.stepper.pulse_start;
    hal.stepper.pulse_start = count;
    hal.homing.get_state = switched;
    system_register_commands(&commands);
    my_plugin_init();
    return is_ready && (arm != NULL) && (motors != NULL);
}
