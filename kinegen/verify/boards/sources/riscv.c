/* RV32 in QEMU's machine `virt`: start-up, text by semihosting, the counter of instructions as clock. */
#include "board.h"

/* Operations of the semihosting that RISC-V shares with Arm, and the reason that stands for a program's own end. */
enum { WRITE_TEXT = 0x04, EXIT = 0x20 };
#define PROGRAM_ENDED 0x20026u

/* The counters and control registers are an extension of their own, which kernels do not need. */
__asm__(".option arch, +zicsr");

int main(void);
void board_begin(void);

static uint32_t started;

/* The three instructions mark a request; they may be neither compressed nor split over two pages. */
static void ask_host(uint32_t operation, const void *argument)
{
    register uint32_t a0 __asm__("a0") = operation;
    register const void *a1 __asm__("a1") = argument;
    __asm__ volatile(".option push\n\t.option norvc\n\t.balign 16\n\t"
                     "slli x0, x0, 0x1f\n\tebreak\n\tsrai x0, x0, 7\n\t.option pop"
                     : "+r"(a0)
                     : "r"(a1)
                     : "memory");
}

static void leave(uint32_t status)
{
    const uint32_t block[2] = {PROGRAM_ENDED, status};
    ask_host(EXIT, block);
    for (;;) {
    }
}

/* A fault ends the emulator with status 1; a loop would only run into the time limit. */
__attribute__((aligned(4), used)) static void fault(void)
{
    leave(1);
}

__attribute__((section(".vectors"), naked, used)) void board_reset(void)
{
    __asm__ volatile("la sp, board_stack\n\tj board_begin");
}

void board_begin(void)
{
    __asm__ volatile("csrw mtvec, %0" : : "r"(fault));
#ifdef __riscv_flen
    __asm__ volatile("csrs mstatus, %0" : : "r"(1u << 13)); /* the FPU is off until its state is called initial */
#endif
    leave((uint32_t)main());
}

void board_write(const char *text)
{
    ask_host(WRITE_TEXT, text);
}

static uint32_t instructions(void)
{
    uint32_t count;
    __asm__ volatile("csrr %0, minstret" : "=r"(count));
    return count;
}

void board_clock_start(void)
{
    started = instructions();
}

uint32_t board_clock_read(void)
{
    return instructions() - started;
}

__attribute__((noinline)) void board_spin(uint16_t rounds)
{
    uint32_t left = (uint32_t)rounds + 1;
    __asm__ volatile("1:\taddi %0, %0, -1\n\tbnez %0, 1b" : "+r"(left));
}
