/* A component for tests: opens a kinematics module that is loaded already, reads requests from the file that PROBE_IN
   names, and writes answers to the file that PROBE_OUT names. SPDX-License-Identifier: MIT

   Requests, one a line:
     use FILE                       the shared object of the module
     forward N joints.. x y z a b c       what world holds before the call; prints result x y z a b c
     inverse N joints.. x y z a b c       prints result joints..
     ticks COUNT N file             pairs of forward and inverse for joint vectors of a file; prints ticks of each pair, failures
*/
#include <dlfcn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "rtapi.h"
#include "rtapi_app.h"
#include "hal.h"
#include "emcpos.h"
#include "kinematics.h"

MODULE_LICENSE("GPL");

typedef int (*forward_function)(const double *, EmcPose *, const KINEMATICS_FORWARD_FLAGS *, KINEMATICS_INVERSE_FLAGS *);
typedef int (*inverse_function)(const EmcPose *, double *, const KINEMATICS_INVERSE_FLAGS *, KINEMATICS_FORWARD_FLAGS *);

static int component;
static forward_function forward;
static inverse_function inverse;
static KINEMATICS_FORWARD_FLAGS fflags;
static KINEMATICS_INVERSE_FLAGS iflags;

static void use(const char *const name)
{
    void *const module = dlopen(name, RTLD_NOW | RTLD_NOLOAD);
    forward = module ? (forward_function)dlsym(module, "kinematicsForward") : NULL;
    inverse = module ? (inverse_function)dlsym(module, "kinematicsInverse") : NULL;
}

static void read_case(FILE *const in, double joint[16], EmcPose *const world)
{
    int count = 0;
    memset(world, 0, sizeof *world);
    for (int i = 0; i < 16; i++) {
        joint[i] = 0.0;
    }
    if (fscanf(in, "%d", &count) == 1) {
        for (int i = 0; i < count; i++) {
            if (fscanf(in, "%lf", &joint[i]) != 1) {
                return;
            }
        }
    }
    if (fscanf(in, "%lf %lf %lf %lf %lf %lf", &world->tran.x, &world->tran.y, &world->tran.z, &world->a, &world->b,
            &world->c) != 6) {
        return;
    }
}

/* Ticks of a pair: the pose of joint values, then joint values for it from others beside them. */
static void ticks(FILE *const in, FILE *const out)
{
    int count = 0, joints = 0, failed = 0;
    if (fscanf(in, "%d %d", &count, &joints) != 2) {
        return;
    }
    for (int k = 0; k < count; k++) {
        double joint[16] = {0.0}, seed[16] = {0.0}, found[16] = {0.0};
        EmcPose world;
        int result = 0;
        uint64_t best = UINT64_MAX;
        for (int i = 0; i < (2 * joints); i++) {
            if (fscanf(in, "%lf", (i < joints) ? &joint[i] : &seed[i - joints]) != 1) {
                return;
            }
        }
        for (int again = 0; again < 5; again++) {
            memset(&world, 0, sizeof world);
            memcpy(found, seed, sizeof found);
            const uint64_t begin = __builtin_ia32_rdtsc();
            result = forward(joint, &world, &fflags, &iflags);
            result |= inverse(&world, found, &iflags, &fflags);
            const uint64_t taken = __builtin_ia32_rdtsc() - begin;
            best = (taken < best) ? taken : best;
        }
        failed += (result != 0);
        fprintf(out, "%llu\n", (unsigned long long)best);
    }
    fprintf(out, "failed %d\n", failed);
}

static void answer(FILE *const in, FILE *const out)
{
    char word[256];
    double joint[16];
    EmcPose world;

    while (fscanf(in, "%255s", word) == 1) {
        if (strcmp(word, "use") == 0) {
            if (fscanf(in, "%255s", word) == 1) {
                use(word);
                fprintf(out, "%s\n", (forward && inverse) ? "found" : "missing");
            }
        } else if (strcmp(word, "forward") == 0) {
            read_case(in, joint, &world);
            const int result = forward(joint, &world, &fflags, &iflags);
            fprintf(out, "%d %.17g %.17g %.17g %.17g %.17g %.17g\n", result, world.tran.x, world.tran.y, world.tran.z,
                world.a, world.b, world.c);
        } else if (strcmp(word, "inverse") == 0) {
            read_case(in, joint, &world);
            const int result = inverse(&world, joint, &iflags, &fflags);
            fprintf(out, "%d", result);
            for (int i = 0; i < 9; i++) {
                fprintf(out, " %.17g", joint[i]);
            }
            fprintf(out, "\n");
        } else if (strcmp(word, "ticks") == 0) {
            ticks(in, out);
        }
    }
}

int rtapi_app_main(void)
{
    component = hal_init("kinegen_probe");
    if (component < 0) {
        return component;
    }
    FILE *const in = fopen(getenv("PROBE_IN"), "r");
    FILE *const out = fopen(getenv("PROBE_OUT"), "w");
    if (in && out) {
        answer(in, out);
    }
    if (in) {
        fclose(in);
    }
    if (out) {
        fclose(out);
    }
    hal_ready(component);
    return 0;
}

void rtapi_app_exit(void)
{
    hal_exit(component);
}
