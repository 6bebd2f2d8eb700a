/* A stand-in for LinuxCNC's header of the same name, written for tests. SPDX-License-Identifier: MIT */
#ifndef STANDIN_EMCPOS_H
#define STANDIN_EMCPOS_H

typedef struct {
    double x, y, z;
} PmCartesian;

/* Columns. */
typedef struct {
    PmCartesian x, y, z;
} PmRotationMatrix;

typedef struct EmcPose {
    PmCartesian tran;
    double a, b, c;
    double u, v, w;
} EmcPose;

#endif
