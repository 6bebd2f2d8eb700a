/* A stand-in for LinuxCNC's header of the same name, written for tests. SPDX-License-Identifier: MIT */
#ifndef STANDIN_HAL_H
#define STANDIN_HAL_H

static inline int hal_init(const char *name)
{
    return name[0] != '\0';
}

static inline void hal_ready(int component)
{
    (void)component;
}

static inline void hal_exit(int component)
{
    (void)component;
}

#endif
