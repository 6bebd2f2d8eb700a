/* Cortex-M in QEMU: start-up, text by semihosting, the SysTick timer as clock. */
#include "board.h"

#define SYSTICK_CONTROL (*(volatile uint32_t *)0xE000E010u)
#define SYSTICK_RELOAD (*(volatile uint32_t *)0xE000E014u)
#define SYSTICK_CURRENT (*(volatile uint32_t *)0xE000E018u)
#define SYSTICK_RAN_OVER (1u << 16)
#define SYSTICK_LAST 0xFFFFFFu
#define COPROCESSOR_ACCESS (*(volatile uint32_t *)0xE000ED88u)

/* Operations of Arm's semihosting, and the reason that stands for a program's own end. */
enum { WRITE_TEXT = 0x04, EXIT = 0x20 };
#define PROGRAM_ENDED 0x20026u

extern uint32_t board_stack; /* its address is the end of RAM; see board.ld */

int main(void);
void board_reset(void);

static void ask_host(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

static void leave(uint32_t status)
{
    const uint32_t block[2] = {PROGRAM_ENDED, status};
    ask_host(EXIT, block);
    for (;;) {
    }
}

/* A fault ends the emulator with status 1; a loop would only run into the time limit. */
static void fault(void)
{
    leave(1);
}

void board_reset(void)
{
#ifdef __ARM_FP
    /* Full access to coprocessors 10 and 11, which are the FPU: without it the first float instruction faults. */
    COPROCESSOR_ACCESS |= 0xFu << 20;
    __asm__ volatile("dsb\n\tisb");
#endif
    leave((uint32_t)main());
}

__attribute__((section(".vectors"), used)) static void *const vectors[16] = {
    &board_stack, (void *)board_reset, (void *)fault, (void *)fault, (void *)fault, (void *)fault,
    (void *)fault, (void *)fault,      (void *)fault, (void *)fault, (void *)fault, (void *)fault,
    (void *)fault, (void *)fault,      (void *)fault, (void *)fault,
};

void board_write(const char *text)
{
    ask_host(WRITE_TEXT, text);
}

void board_clock_start(void)
{
    SYSTICK_RELOAD = SYSTICK_LAST;
    SYSTICK_CURRENT = 0;
    SYSTICK_CONTROL = 5; /* on, from the processor's clock, no interrupt */
}

uint32_t board_clock_read(void)
{
    const uint32_t left = SYSTICK_CURRENT;
    return (SYSTICK_CONTROL & SYSTICK_RAN_OVER) ? UINT32_MAX : SYSTICK_LAST - left;
}

__attribute__((noinline)) void board_spin(uint16_t rounds)
{
    uint32_t left = (uint32_t)rounds + 1;
    __asm__ volatile(".syntax unified\n1:\tsubs %0, %0, #1\n\tbne 1b" : "+l"(left) : : "cc");
}
