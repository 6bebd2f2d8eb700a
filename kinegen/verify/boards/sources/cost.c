/* Prints what one call of a kernel takes: ticks of the clock for several inputs, and bytes of stack.
 *
 * The table holds the kernel and, behind it, a function of the same type that does nothing. What calling that one takes
 * is subtracted, so that loop, call and clock cancel out.
 */
#include "board.h"

#ifdef __AVR__
enum { PAINTED = 1536 };
#else
enum { PAINTED = 6144 };
#endif
enum { INPUTS = 32, SPIN = 10000 }; /* REPEATS comes from the command line */
#define PAINT 0xA5u

static uint32_t state = 2463534242u;

/* Anything from -pi to pi, roughly; integers hold any binary angle. */
static real angle(void)
{
    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
#ifdef INTEGERS
    return (real)state;
#else
    return (real)((int32_t)(state >> 8) - 8388608L) * (real)3.74507e-7;
#endif
}

static void write_line(const char *label, uint32_t number)
{
    char text[12];
    uint16_t place = 11;
    text[place] = '\0';
    do {
        place--;
        text[place] = (char)('0' + number % 10u);
        number /= 10u;
    } while (number > 0);
    board_write(label);
    board_write(&text[place]);
    board_write("\n");
}

__attribute__((noinline)) static uint32_t ticks(const board_kernel *kernel)
{
    board_clock_start();
    for (uint16_t repeat = 0; repeat < REPEATS; repeat++) {
        kernel->run(board_joints, board_numbers);
    }
    return board_clock_read();
}

__attribute__((noinline)) static uint32_t spin_ticks(uint16_t rounds)
{
    board_clock_start();
    board_spin(rounds);
    return board_clock_read();
}

/* Paints the free stack, calls, and looks how far down the paint is gone. */
__attribute__((noinline)) static uint32_t depth(const board_kernel *kernel)
{
    void (*const run)(const real *q, real *result) = kernel->run;
    volatile uint8_t *top;
    BOARD_STACK_POINTER(top);
#ifdef __AVR__
    top++; /* the pointer of an AVR stands at the first free byte, not at the last used one */
#endif
    for (uint16_t below = 1; below <= PAINTED; below++) {
        top[-(int16_t)below] = PAINT;
    }
    run(board_joints, board_numbers);
    uint16_t used = PAINTED;
    while (used > 0 && top[-(int16_t)used] == PAINT) {
        used--;
    }
    return used;
}

int main(void)
{
    const board_kernel *const kernel = &board_kernels[0];
    const board_kernel *const nothing = &board_kernels[1];
    uint32_t deepest = 0;
    write_line("spin ", spin_ticks(SPIN) - spin_ticks(0));
    for (uint16_t input = 0; input < INPUTS; input++) {
        for (uint16_t joint = 0; joint < kernel->joints; joint++) {
            board_joints[joint] = angle();
            if (board_example_count > 0) {
                board_joints[joint] = board_examples[(input % board_example_count) * kernel->joints + joint];
            }
        }
        const uint32_t taken = ticks(kernel);
        if (taken == UINT32_MAX) {
            board_write("the clock has run over\n");
            return 1;
        }
        write_line("call ", taken - ticks(nothing));
        const uint32_t used = depth(kernel) - depth(nothing);
        deepest = (used > deepest) ? used : deepest;
    }
    write_line("stack ", deepest);
    return 0;
}
