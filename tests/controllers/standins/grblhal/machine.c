/* A machine for tests of the plug-in: it moves as the planner plans it. SPDX-License-Identifier: MIT

   Input: steps per unit of each motor, motors at the start in their units, the mask of axes homed in the negative
   direction, the pull-off; then commands:
     feed F x y z ..      a move at F mm/min; `rapid`, `inverse F` (in 1/F minutes) and `jog F` likewise
     cancelled N F x ..   a jog that is cancelled after N pieces
     home axis            a homing move of one axis by 40 units, and a pull-off
     single x y z ..      a target that is planned as one block
     set N value          a setting, and the position of the tool afterwards, as "here"
     restart              the power goes off and on; settings are loaded
     clip x y z ..        a target shortened to what is within reach
   Output: "place" with motors, the position of their steps, the minutes of the block and the speed that is reported for
   it; "home" with the motors after homing and the home position; at the end of each command "end" with the alarm. */
#include "grbl/hal.h"
#include "grbl/kinematics/interface.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

settings_t settings;
system_t sys;
kinematics_t kinematics;
grbl_t grbl;
grbl_hal_t hal;
parser_state_t gc_state;

static setting_details_t *registered;
static uint8_t kept[256];
static bool is_kept;

static coord_data_t pull_off;
static alarm_code_t raised;

void my_plugin_init(void);

void system_raise_alarm(alarm_code_t alarm)
{
    raised = alarm;
}

void system_convert_array_steps_to_mpos(float *position, int32_t *steps)
{
    (void)kinematics.transform_steps_to_cartesian((coord_data_t *)position, (mpos_t *)steps);
}

void plan_sync_position(void)
{
}

nvs_address_t nvs_alloc(size_t size)
{
    return (size <= sizeof kept) ? 1U : 0U;
}

void settings_register(setting_details_t *details)
{
    registered = details;
}

static bool keep(uint32_t to, uint8_t *from, uint32_t size, bool with_checksum)
{
    (void)to;
    is_kept = with_checksum;
    memcpy(kept, from, size);
    return true;
}

static bool recall(uint8_t *to, uint32_t from, uint32_t size, bool with_checksum)
{
    (void)from;
    if (is_kept && with_checksum) {
        memcpy(to, kept, size);
    }
    return is_kept;
}

/* What grblHAL does when it starts. */
static void load(void)
{
    if (registered != NULL) {
        registered->load();
        registered->on_changed(&settings, (settings_changed_flags_t){0});
    }
}

/* What it makes of $id=value. */
static void set(setting_id_t id, float value)
{
    for (int i = 0; i < registered->n_settings; i++) {
        if (registered->settings[i].id == id) {
            *(float *)registered->settings[i].value = value;
        }
    }
    registered->save();
    registered->on_changed(&settings, (settings_changed_flags_t){0});
}

void limits_set_machine_positions(axes_signals_t cycle, bool add_pulloff)
{
    (void)add_pulloff;
    for (int i = 0; i < N_AXIS; i++) {
        if ((cycle.mask >> i) & 1) {
            sys.position[i] = 0;
        }
    }
}

coord_data_t *limits_homing_pulloff(coord_data_t *distance)
{
    return (distance == NULL) ? &pull_off : NULL;
}

static float motor(int axis)
{
    return (float)sys.position[axis] / settings.axis[axis].steps_per_mm;
}

static void print(const char *word, const float *numbers)
{
    (void)printf("%s", word);
    for (int i = 0; i < N_AXIS; i++) {
        (void)printf(" %.9g", (double)numbers[i]);
    }
}

/* What the planner makes of a block: its length is that of the motors' steps, its rate the feed. */
static void block(const float *motors, const plan_line_data_t *plan)
{
    coord_data_t position;
    double sum = 0.0;
    for (int i = 0; i < N_AXIS; i++) {
        const int32_t steps = (int32_t)lroundf(motors[i] * settings.axis[i].steps_per_mm);
        const double moved = (double)(steps - sys.position[i]) / (double)settings.axis[i].steps_per_mm;
        sum += moved * moved;
        sys.position[i] = steps;
    }
    memset(&position, 0x7f, sizeof position); /* as a variable that was never set */
    system_convert_array_steps_to_mpos(position.values, sys.position);
    print("place", motors);
    print("", position.values);
    const double length = sqrt(sum);
    const double rate = (double)plan->feed_rate * (plan->condition.inverse_time ? length : 1.0);
    (void)printf(" %.9g %.9g\n", (length > 0.0) ? (length / rate) : 0.0, rate * (double)plan->rate_multiplier);
}

static void move(const float *target, plan_line_data_t plan, int cancelled)
{
    coord_data_t present, goal;
    const float feed = plan.feed_rate;
    for (int i = 0; i < N_AXIS; i++) {
        present.values[i] = motor(i);
        goal.values[i] = target[i];
    }
    /* The pointer of the first call is what is planned from after every further one. */
    const float *const planned = kinematics.segment_line(&goal, &present, &plan, true)->values;
    if (plan.condition.target_validated && !plan.condition.target_valid) {
        raised = Alarm_SoftLimit;
        return;
    }
    while (kinematics.segment_line(&goal, NULL, &plan, false) != NULL) {
        block(planned, &plan);
        plan.feed_rate = feed;
        if (--cancelled == 0) {
            grbl.on_jog_cancel(0);
        }
    }
}

static void home(int axis)
{
    plan_line_data_t plan = {.feed_rate = 100.0F, .rate_multiplier = 1.0F};
    coord_data_t target, motors;
    const float direction = ((settings.homing.dir_mask.mask >> axis) & 1) ? -1.0F : 1.0F;
    const float moves[2] = {direction * 40.0F, -direction * pull_off.values[axis]};
    for (int k = 0; k < 2; k++) {
        system_convert_array_steps_to_mpos(target.values, sys.position);
        kinematics.limits_set_target_pos((uint_fast8_t)axis);
        target.values[axis] = moves[k];
        block(kinematics.transform_from_cartesian(&motors, &target)->values, &plan);
    }
    kinematics.limits_set_machine_positions((axes_signals_t){.mask = (uint8_t)(1U << axis)});
    for (int i = 0; i < N_AXIS; i++) {
        motors.values[i] = motor(i);
    }
    print("home", motors.values);
    print("", sys.home_position);
    (void)printf("\n");
}

static bool read(float *numbers, int count)
{
    for (int i = 0; i < count; i++) {
        if (scanf("%f", &numbers[i]) != 1) {
            return false;
        }
    }
    return true;
}

static void write(const char *text)
{
    (void)printf("said %s", text);
}

int main(void)
{
    coord_data_t at;
    float mask;
    char word[16];

    hal.stream.write = write;
    hal.nvs.memcpy_to_nvs = keep;
    hal.nvs.memcpy_from_nvs = recall;
    my_plugin_init();
    load();
    grbl.on_report_options(false);
    for (int i = 0; i < N_AXIS; i++) {
        if (!read(&settings.axis[i].steps_per_mm, 1)) {
            return 1;
        }
    }
    if (!read(at.values, N_AXIS) || !read(&mask, 1) || !read(&pull_off.values[0], 1)) {
        return 1;
    }
    settings.homing.dir_mask.mask = (uint8_t)mask;
    sys.homing.mask = 0xff;
    for (int i = 0; i < N_AXIS; i++) {
        pull_off.values[i] = pull_off.values[0];
        sys.position[i] = (int32_t)lroundf(at.values[i] * settings.axis[i].steps_per_mm);
    }
    while (scanf("%15s", word) == 1) {
        plan_line_data_t plan = {.feed_rate = 1.0F, .rate_multiplier = 1.0F};
        coord_data_t target, motors;
        float pieces = 0.0F, axis = 0.0F;
        plan.condition.rapid_motion = (strcmp(word, "rapid") == 0);
        plan.condition.inverse_time = (strcmp(word, "inverse") == 0);
        plan.condition.jog_motion = (strcmp(word, "jog") == 0) || (strcmp(word, "cancelled") == 0);
        raised = Alarm_None;
        if (strcmp(word, "home") == 0) {
            (void)read(&axis, 1);
            home((int)axis);
        } else if (strcmp(word, "single") == 0) {
            (void)read(target.values, N_AXIS);
            print("single", kinematics.transform_from_cartesian(&motors, &target)->values);
            (void)printf("\n");
        } else if (strcmp(word, "set") == 0) {
            float numbers[2];
            (void)read(numbers, 2);
            set((setting_id_t)numbers[0], numbers[1]);
            print("here", gc_state.position);
            (void)printf("\n");
        } else if (strcmp(word, "restart") == 0) {
            load();
            print("here", gc_state.position);
            (void)printf("\n");
        } else if (strcmp(word, "clip") == 0) {
            (void)read(target.values, N_AXIS);
            const bool is_within = grbl.check_travel_limits(target.values, (axes_signals_t){0}, true, NULL);
            grbl.apply_travel_limits(target.values, NULL, NULL);
            print(is_within ? "within" : "beyond", target.values);
            (void)printf("\n");
        } else {
            if (strcmp(word, "cancelled") == 0) {
                (void)read(&pieces, 1);
            }
            if (!plan.condition.rapid_motion) {
                (void)read(&plan.feed_rate, 1);
            }
            (void)read(target.values, N_AXIS);
            move(target.values, plan, (int)pieces);
        }
        (void)printf("end %d\n", (int)raised);
    }
    return 0;
}
