/* What a board offers to the programs that check and measure kernels on it; arm.c, riscv.c, avr.c and host.c do it.
 *
 * Compiled with -DREAL=float or -DREAL=double, the number type of the kernels, or -DREAL=int32_t -DINTEGERS.
 */
#ifndef KINEGEN_BOARD_H
#define KINEGEN_BOARD_H

#include <stddef.h>
#include <stdint.h>

typedef REAL real;

/* Writes text to the standard output of whoever runs the emulator. */
void board_write(const char *text);

/* Sets the clock to zero; it advances evenly with instructions, or with cycles on an AVR. */
void board_clock_start(void);

/* Ticks since then; UINT32_MAX where the clock has run over. */
uint32_t board_clock_read(void);

/* Takes as many instructions (AVR: cycles) as the table of targets says for each round, and some for the call. */
void board_spin(uint16_t rounds);

/* The stack pointer of the caller: everything below is free. */
#if defined(__arm__)
#define BOARD_STACK_POINTER(p) __asm__ volatile("mov %0, sp" : "=r"(p))
#elif defined(__riscv)
#define BOARD_STACK_POINTER(p) __asm__ volatile("mv %0, sp" : "=r"(p))
#elif defined(__AVR__)
#define BOARD_STACK_POINTER(p) __asm__ volatile("in %A0, 0x3d\n\tin %B0, 0x3e" : "=r"(p))
#endif

/* One kernel with the arguments reduced to arrays; kernels.c, written for each program, holds the table of them. */
typedef struct {
    const char *name;
    void (*run)(const real *q, real *result);
    uint16_t joints;  /* entries of q */
    uint16_t numbers; /* entries of result */
    real beyond;      /* the smallest angle out of range */
} board_kernel;

extern const board_kernel board_kernels[];
extern const uint16_t board_kernel_count;

/* Inputs of the first kernel, one set after the other, where random numbers will not do. */
extern const real board_examples[];
extern const uint16_t board_example_count;

/* Room for the arguments of any kernel in the table. */
extern real board_joints[];
extern real board_numbers[];

#endif
