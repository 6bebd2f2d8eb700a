/* Compares both ways to multiply, and each with the definition, on factors from everywhere in their ranges.

   Prints the number of products that differ. */
#include <stdint.h>
#include <stdio.h>

#define robot_q30_mul whole_mul
#define robot_q30_high whole_high
#include "whole.c"
#undef robot_q30_mul
#undef robot_q30_high
#define robot_q30_mul halves_mul
#define robot_q30_high halves_high
#include "halves.c"

static uint64_t state = 88172645463325252u;

static uint32_t random_bits(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (uint32_t)(state >> 32);
}

/* A number near the end of a range, near a multiple of 2^15, or anywhere. */
static int32_t pick(int64_t largest)
{
    const int64_t span = 2 * largest + 1;
    const int64_t anywhere = (int64_t)random_bits() % span - largest;
    switch (random_bits() & 3u) {
    case 0:
        return (int32_t)(largest - (int64_t)(random_bits() & 3u));
    case 1:
        return (int32_t)((int64_t)(random_bits() & 3u) - largest);
    case 2:
        return (int32_t)(anywhere / 32768 * 32768);
    default:
        return (int32_t)anywhere;
    }
}

static int64_t floor_of(int64_t product, int64_t power)
{
    const int64_t rest = ((product % power) + power) % power;
    return (product - rest) / power;
}

int main(void)
{
    long wrong = 0;
    for (long i = 0; i < 3000000; i++) {
        const int32_t b = pick(LARGEST_FACTOR);
        const int32_t a = pick(2147483647);
        const int64_t exact = floor_of((int64_t)a * b + 536870912, 1073741824);
        wrong += whole_high(a, b) != floor_of((int64_t)a * b, 4294967296);
        wrong += halves_high(a, b) != whole_high(a, b);
        if ((exact <= LARGEST) && (exact >= -LARGEST)) {
            wrong += whole_mul(a, b) != exact;
            wrong += halves_mul(a, b) != exact;
        }
    }
    printf("%ld\n", wrong);
    return 0;
}
