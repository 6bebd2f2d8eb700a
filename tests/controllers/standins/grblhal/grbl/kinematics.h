/* A stand-in for grblHAL's header of the same name, written for tests. SPDX-License-Identifier: MIT */
#ifndef STANDIN_KINEMATICS_H
#define STANDIN_KINEMATICS_H

typedef struct {
    float *(*transform_steps_to_cartesian)(float *position, int32_t *steps);
    float *(*transform_from_cartesian)(float *target, float *position);
    float *(*segment_line)(float *target, float *position, plan_line_data_t *pl_data, bool init);
    uint_fast8_t (*limits_get_axis_mask)(uint_fast8_t idx);
    void (*limits_set_target_pos)(uint_fast8_t idx);
    void (*limits_set_machine_positions)(axes_signals_t cycle);
    bool (*homing_cycle_validate)(axes_signals_t cycle);
    float (*homing_cycle_get_feedrate)(axes_signals_t axes, float rate, homing_mode_t mode);
} kinematics_t;

extern kinematics_t kinematics;

#endif
