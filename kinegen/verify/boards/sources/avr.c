/* ATmega2560 in simavr: text by the first serial port, timers 1 and 3 as clock. The start-up is avr-libc's. */
#include "board.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

int main(void);

/* Runs before main, where avr-libc keeps a place for it. */
__attribute__((naked, used, section(".init5"))) void board_begin(void)
{
    UCSR0B = 1 << TXEN0;
}

/* Runs after main: simavr ends when the processor sleeps and nothing can wake it. */
__attribute__((naked, used, section(".fini5"))) void board_end(void)
{
    cli();
    sleep_enable();
    sleep_cpu();
}

void board_write(const char *text)
{
    for (; *text != '\0'; text++) {
        while ((UCSR0A & (1 << UDRE0)) == 0) {
        }
        UDR0 = (uint8_t)*text;
    }
}

/* Timer 1 counts cycles and soon runs over; timer 3 counts every 64th, which tells how often. */
void board_clock_start(void)
{
    TCCR1B = 0;
    TCCR3B = 0;
    TCNT1 = 0;
    TCNT3 = 0;
    TCCR3B = (1 << CS31) | (1 << CS30);
    TCCR1B = 1 << CS10;
}

uint32_t board_clock_read(void)
{
    const uint16_t fine = TCNT1;
    const uint32_t coarse = (uint32_t)TCNT3 << 6;
    return coarse + (uint32_t)(int32_t)(int16_t)(fine - (uint16_t)coarse);
}

__attribute__((noinline)) void board_spin(uint16_t rounds)
{
    uint16_t left = rounds + 1u;
    __asm__ volatile("1:\tsbiw %0, 1\n\tbrne 1b" : "+w"(left));
}
