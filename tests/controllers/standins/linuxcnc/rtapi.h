/* A stand-in for LinuxCNC's header of the same name, written for tests. SPDX-License-Identifier: MIT */
#ifndef STANDIN_RTAPI_H
#define STANDIN_RTAPI_H

enum { RTAPI_MSG_ERR = 1 };

#define rtapi_print_msg(level, ...) ((void)(level))

#endif
