/* The mechanics of an arm below grblHAL's simulator: motors that count their own steps, and switches at their limits.
   SPDX-License-Identifier: MIT

   Compiled with the core and the simulator of a checkout, with -Wl,--wrap=driver_init, by scripts/try_controllers.py.
   It reads the file `arm`: for each axis a line of the place where its motor is, and of its two switches, in steps.
   It writes the file `motors`: the time in seconds and the steps of all motors, every millisecond in which one moved. */
#include "driver.h"
#include "simulator.h"
#include "grbl/grbl.h"
#include "grbl/hal.h"

#include <stdbool.h>
#include <stdio.h>

bool __real_driver_init(void);
bool __wrap_driver_init(void);
void my_plugin_init(void);

static int64_t at[N_AXIS], switches[N_AXIS][2];
static void (*pulse)(stepper_t *);
static FILE *motors;
static double written = -1.0;

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

bool __wrap_driver_init(void)
{
    static const sys_command_t list[] = {{"MOTORS", say_motors, {.noargs = On}, {.str = "steps of all motors"}}};
    static sys_commands_t commands = {.n_commands = 1, .commands = list};
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
