/* Runs the kernels of a robot on an emulated board: a digest of all results, and what one call of fk takes.
 *
 * HEADER, DOF, TIPS, FRAME_COUNT and the kernels FK, FRAMES and POSITION come from the command line.
 */
#include HEADER

#include "board.h"

enum { INPUTS = 200, REPEATS = 8, SPIN = 10000 };

static uint32_t state = 2463534242u;
static int32_t q[DOF];
static int32_t numbers[16 * 32];
static uint32_t digest = 2166136261u;

static uint32_t random_bits(void)
{
    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return state;
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

static void take(uint16_t count)
{
    for (uint16_t i = 0; i < count; i++) {
        digest = (digest ^ (uint32_t)numbers[i]) * 16777619u;
    }
}

static uint32_t ticks(uint16_t repeats)
{
    board_clock_start();
    for (uint16_t repeat = 0; repeat < repeats; repeat++) {
        FK(q, (void *)numbers);
    }
    return board_clock_read();
}

static uint32_t spin_ticks(uint16_t rounds)
{
    board_clock_start();
    board_spin(rounds);
    return board_clock_read();
}

int main(void)
{
    uint32_t least = UINT32_MAX;
    uint32_t most = 0;
    for (uint16_t input = 0; input < INPUTS; input++) {
        for (uint16_t joint = 0; joint < DOF; joint++) {
            const uint32_t bits = random_bits();
            /* Now and then an end of the range. */
            q[joint] = (bits % 8u == 0) ? ((bits & 8u) ? INT32_MIN : INT32_MAX) : (int32_t)bits;
        }
        for (uint16_t i = 0; i < 16 * 32; i++) {
            numbers[i] = 0;
        }
        FK(q, (void *)numbers);
        take(16 * TIPS);
        FRAMES(q, (void *)numbers);
        take(16 * FRAME_COUNT);
        POSITION(q, (void *)numbers);
        take(3 * TIPS);
        const uint32_t taken = ticks(2 * REPEATS) - ticks(REPEATS);
        least = (taken < least) ? taken : least;
        most = (taken > most) ? taken : most;
    }
    write_line("digest ", digest);
    write_line("spin ", spin_ticks(SPIN) - spin_ticks(0));
    write_line("least ", least);
    write_line("most ", most);
    return 0;
}
