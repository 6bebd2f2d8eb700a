/* A stand-in for LinuxCNC's header of the same name, written for tests: as in 2.9, with the frames of the tool and of the
   work if STANDIN_FRAMES is defined (pull request 4455), and with the Jacobian if STANDIN_JACOBIAN is (4550).
   SPDX-License-Identifier: MIT */
#ifndef STANDIN_KINEMATICS_H
#define STANDIN_KINEMATICS_H

#include "emcpos.h"

typedef enum { KINEMATICS_IDENTITY = 1, KINEMATICS_BOTH = 4 } KINEMATICS_TYPE;
typedef unsigned long int KINEMATICS_FORWARD_FLAGS;
typedef unsigned long int KINEMATICS_INVERSE_FLAGS;

int kinematicsForward(const double *joint, struct EmcPose *world, const KINEMATICS_FORWARD_FLAGS *fflags,
    KINEMATICS_INVERSE_FLAGS *iflags);
int kinematicsInverse(const struct EmcPose *world, double *joint, const KINEMATICS_INVERSE_FLAGS *iflags,
    KINEMATICS_FORWARD_FLAGS *fflags);
KINEMATICS_TYPE kinematicsType(void);
int kinematicsSwitchable(void);

#define KINS_NOT_SWITCHABLE        \
    int kinematicsSwitchable(void) \
    {                              \
        return 0;                  \
    }

#ifdef STANDIN_FRAMES
#define TOOL_FRAME_MAX_SOLUTIONS 8

int kinematicsToolFrame(const double *joint, PmRotationMatrix *rot, const KINEMATICS_FORWARD_FLAGS *fflags);
int kinematicsWorkFrame(const double *joint, PmRotationMatrix *rot, const KINEMATICS_FORWARD_FLAGS *fflags);
#endif

#ifdef STANDIN_JACOBIAN
#define EMCMOT_MAX_JOINTS 16
#define EMCMOT_MAX_AXIS 9
#define KINS_JACOBIAN_STEP 1e-3

int kinematicsJacobian(const double *joint, const EmcPose *world, double jac[EMCMOT_MAX_JOINTS][EMCMOT_MAX_AXIS],
    const KINEMATICS_INVERSE_FLAGS *iflags);
#endif

#endif
