/* A stand-in for LinuxCNC's header of the same name, written for tests. SPDX-License-Identifier: MIT */
#ifndef STANDIN_RTAPI_APP_H
#define STANDIN_RTAPI_APP_H

#define MODULE_LICENSE(text) _Static_assert(sizeof(text) > 1, "the licence of the module")
#define MODULE_DESCRIPTION(text) _Static_assert(sizeof(text) > 1, "what the module is")
#define EXPORT_SYMBOL(name) extern __typeof__(name) name

int rtapi_app_main(void);
void rtapi_app_exit(void);

#endif
