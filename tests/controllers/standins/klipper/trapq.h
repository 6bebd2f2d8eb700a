/* A stand-in for Klipper's header of the same name, written for tests: a move at constant speed.
   SPDX-License-Identifier: MIT */
#ifndef STANDIN_TRAPQ_H
#define STANDIN_TRAPQ_H

struct coord {
    double x, y, z;
};

struct move {
    struct coord start, speed;
};

static inline struct coord move_get_coord(struct move *m, double t)
{
    const struct coord at = {m->start.x + (m->speed.x * t), m->start.y + (m->speed.y * t), m->start.z + (m->speed.z * t)};
    return at;
}

#endif
