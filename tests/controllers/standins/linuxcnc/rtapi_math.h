/* A stand-in for LinuxCNC's header of the same name, written for tests. SPDX-License-Identifier: MIT */
#include <math.h>
