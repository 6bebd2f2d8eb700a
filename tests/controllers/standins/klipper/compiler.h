/* A stand-in for Klipper's header of the same name, written for tests. SPDX-License-Identifier: MIT */
#define __visible __attribute__((visibility("default")))
