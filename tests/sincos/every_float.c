/* Tries the float pair on every float of both signs up to 12000. A number behind its name is the step between blocks
   of 1024 floats below 2^-12; four floats of five are there, and a sine is nearly its angle.

   Prints the largest error, then how many results are wrong: further off than 5.4e-8, not a number, of magnitude
   above one, or not symmetric. The true values come from the double pair, whose own error of 1e-16 is left out of
   account. Wrong results are counted in integers, since such loops become vector code: a billion angles take seconds. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sincos.h"

enum { BLOCK = 1024 };

static const double BOUND = 5.4e-8;

static uint32_t to_bits(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static double distance(float result, double exact)
{
    const double difference = (double)result - exact;
    return difference < 0.0 ? -difference : difference;
}

int main(int count, char **words)
{
    static uint32_t bits[BLOCK];
    static float x[2 * BLOCK], s[2 * BLOCK], c[2 * BLOCK];
    static double error[2][BLOCK];
    const uint32_t last = to_bits(12000.0F), small = to_bits(1.0F / 4096.0F);
    const uint32_t step = count > 1 ? (uint32_t)strtoul(words[1], NULL, 10) : 1u;
    uint64_t wrong = 0;
    double worst = 0.0;

    for (uint32_t start = 0, next = 0; start <= last; start = next) {
        next = start + (start < small ? step * BLOCK : BLOCK);
        next = (start < small && next > small) ? small : next;
        for (uint32_t i = 0; i < BLOCK; i++) {
            bits[i] = start + i < last ? start + i : last;
        }
        memcpy(x, bits, sizeof bits);
        for (int i = 0; i < BLOCK; i++) {
            x[BLOCK + i] = -x[i];
        }
        for (int i = 0; i < 2 * BLOCK; i++) {
            kg_f32_sincos(x[i], &s[i], &c[i]);
        }
        for (int i = 0; i < BLOCK; i++) {
            double exact_s, exact_c;
            kg_sincos((double)x[i], &exact_s, &exact_c);
            error[0][i] = distance(s[i], exact_s);
            error[1][i] = distance(c[i], exact_c);
        }
        uint32_t bad = 0;
        for (int i = 0; i < BLOCK; i++) {
            bad += (s[i] == -s[BLOCK + i]) ? 0u : 1u;
            bad += (c[i] == c[BLOCK + i]) ? 0u : 1u;
            bad += (s[i] * s[i] <= 1.0F) ? 0u : 1u;
            bad += (c[i] * c[i] <= 1.0F) ? 0u : 1u;
        }
        uint32_t far = 0;
        for (int i = 0; i < BLOCK; i++) {
            far += (error[0][i] < BOUND) ? 0u : 1u;
            far += (error[1][i] < BOUND) ? 0u : 1u;
        }
        wrong += bad + far;
        /* Below 1e-3 the errors are smaller than the largest by orders of magnitude. */
        for (int i = 0; i < BLOCK && x[0] > 1e-3F; i++) {
            worst = error[0][i] > worst ? error[0][i] : worst;
            worst = error[1][i] > worst ? error[1][i] : worst;
        }
    }
    printf("%.4e %llu\n", worst, (unsigned long long)wrong);
    return 0;
}
