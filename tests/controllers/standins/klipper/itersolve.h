/* A stand-in for Klipper's header of the same name, written for tests: only what the emitted helper uses.
   SPDX-License-Identifier: MIT */
#ifndef STANDIN_ITERSOLVE_H
#define STANDIN_ITERSOLVE_H

enum { AF_X = 1, AF_Y = 2, AF_Z = 4 };

struct move;
struct stepper_kinematics;

typedef double (*sk_calc_callback)(struct stepper_kinematics *sk, struct move *m, double move_time);

struct stepper_kinematics {
    double commanded_pos;
    int active_flags;
    sk_calc_callback calc_position_cb;
};

#endif
