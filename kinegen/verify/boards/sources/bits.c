/* Prints a hash of everything that the kernels return for one set of joint vectors, and how many results are NaN where
 * one angle is no angle. Equal lines on two machines mean equal bits.
 */
#include "board.h"

#ifndef VECTORS
#define VECTORS 48
#endif

static uint32_t state;

/* A number from -2^23 to 2^23 - 1, which a float holds. The generator is Marsaglia's xorshift with shifts 13, 17, 5. */
static int32_t draw(void)
{
    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return (int32_t)(state >> 8) - 8388608L;
}

/* Three angles of four lie within 4 rad, the fourth within 1024 rad; sums of several stay in the range of the pair. */
static real angle(uint16_t vector)
{
    const real scale = ((vector & 3u) == 3u) ? (real)1.220703125e-4 : (real)4.76837158203125e-7;
    const real coarse = (real)draw() * scale;
    const real fine = (real)draw() * (real)2.842170943040401e-14;
    return coarse + fine;
}

static uint64_t mixed(uint64_t hash, real number)
{
    /* FNV-1a, a word at a time; which bits a NaN has is the processor's own affair. */
    if (number != number) {
        return (hash ^ 0x7FC00000u) * 1099511628211u;
    }
    const union {
        real number;
        uint32_t words[sizeof(real) / 4];
    } bits = {number};
    for (uint16_t word = 0; word < sizeof(real) / 4; word++) {
        hash = (hash ^ bits.words[word]) * 1099511628211u;
    }
    return hash;
}

static void write_hash(uint64_t hash)
{
    char text[17];
    for (uint16_t digit = 0; digit < 16; digit++) {
        text[digit] = "0123456789abcdef"[(hash >> (60 - 4 * digit)) & 15u];
    }
    text[16] = '\0';
    board_write(text);
}

static void write_count(uint16_t count)
{
    char text[6];
    uint16_t place = 5;
    text[place] = '\0';
    do {
        place--;
        text[place] = (char)('0' + count % 10u);
        count /= 10u;
    } while (count > 0);
    board_write(&text[place]);
}

static void hash_results(const board_kernel *kernel)
{
    uint64_t hash = 14695981039346656037u;
    state = 2463534242u;
    for (uint16_t vector = 0; vector < VECTORS; vector++) {
        for (uint16_t joint = 0; joint < kernel->joints; joint++) {
            board_joints[joint] = angle(vector);
        }
        kernel->run(board_joints, board_numbers);
        for (uint16_t number = 0; number < kernel->numbers; number++) {
            hash = mixed(hash, board_numbers[number]);
        }
    }
    board_write(kernel->name);
    board_write(" hash ");
    write_hash(hash);
    board_write("\n");
}

static uint16_t count_nan(const board_kernel *kernel)
{
    uint16_t count = 0;
    kernel->run(board_joints, board_numbers);
    for (uint16_t number = 0; number < kernel->numbers; number++) {
        count += board_numbers[number] != board_numbers[number];
    }
    return count;
}

/* One count for each joint that is bad while the others are zero, and one for all of them at once. */
static void try_bad(const board_kernel *kernel, const char *label, real bad)
{
    board_write(kernel->name);
    board_write(label);
    for (uint16_t joint = 0; joint <= kernel->joints; joint++) {
        for (uint16_t other = 0; other < kernel->joints; other++) {
            board_joints[other] = (other == joint || joint == kernel->joints) ? bad : 0;
        }
        board_write(" ");
        write_count(count_nan(kernel));
    }
    board_write("\n");
}

int main(void)
{
    volatile real zero = 0;
    const real infinity = 1 / zero;
    for (uint16_t index = 0; index < board_kernel_count; index++) {
        const board_kernel *const kernel = &board_kernels[index];
        hash_results(kernel);
        try_bad(kernel, " nan", infinity - infinity);
        try_bad(kernel, " infinity", infinity);
        try_bad(kernel, " -infinity", -infinity);
        try_bad(kernel, " beyond", kernel->beyond);
        try_bad(kernel, " -beyond", -kernel->beyond);
        try_bad(kernel, " 1e30", (real)1e30);
    }
    return 0;
}
