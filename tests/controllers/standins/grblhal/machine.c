/* A machine for tests of the plug-in: it moves in lines as the planner asks for them. SPDX-License-Identifier: MIT

   Input: steps per unit of each motor, motors at the start (as steps), then lines: positions x y z c to move to.
   Output, for each line: its planned places as "place" with motors and the position that their steps stand for, then
   "end" with the alarm. */
#include "grbl/hal.h"
#include "grbl/kinematics/interface.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

settings_t settings;
system_t sys;
kinematics_t kinematics;

static alarm_code_t raised;

void my_plugin_init(void);

void system_raise_alarm(alarm_code_t alarm)
{
    raised = alarm;
}

static void report(const float *const motors)
{
    mpos_t steps;
    coord_data_t position = {{0.0F}};
    for (int i = 0; i < N_AXIS; i++) {
        steps.values[i] = (int32_t)lroundf(motors[i] * settings.axis[i].steps_per_mm);
    }
    (void)kinematics.transform_steps_to_cartesian(&position, &steps);
    (void)printf("place");
    for (int i = 0; i < N_AXIS; i++) {
        (void)printf(" %.9g", (double)motors[i]);
    }
    for (int i = 0; i < N_AXIS; i++) {
        (void)printf(" %.9g", (double)position.values[i]);
    }
    (void)printf("\n");
}

int main(void)
{
    coord_data_t at = {{0.0F}};
    plan_line_data_t data = {100.0F};

    my_plugin_init();
    for (int i = 0; i < N_AXIS; i++) {
        if (scanf("%f", &settings.axis[i].steps_per_mm) != 1) {
            return 1;
        }
    }
    for (int i = 0; i < N_AXIS; i++) {
        if (scanf("%f", &at.values[i]) != 1) {
            return 1;
        }
    }
    for (;;) {
        coord_data_t target;
        for (int i = 0; i < N_AXIS; i++) {
            if (scanf("%f", &target.values[i]) != 1) {
                return 0;
            }
        }
        raised = Alarm_None;
        /* The pointer of the first call is what is planned from after every further one. */
        const float *const planned = kinematics.segment_line(&target, &at, &data, true)->values;
        while (kinematics.segment_line(&target, NULL, &data, false) != NULL) {
            memcpy(at.values, planned, sizeof at.values);
            report(planned);
        }
        (void)printf("end %d\n", (int)raised);
    }
}
