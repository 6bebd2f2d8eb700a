// As much of Arduino's core as the examples use, for an AVR in simavr: prints go to the serial port, loop() runs once.
#ifndef STUB_ARDUINO_H
#define STUB_ARDUINO_H

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <stdint.h>

class __FlashStringHelper;
#define F(text) reinterpret_cast<const __FlashStringHelper *>(PSTR(text))

extern uint8_t _end; // of the variables; the stack comes down towards it

struct StubSerial {
    void begin(long) { UCSR0B = 1 << TXEN0; }

    void print(char letter)
    {
        while ((UCSR0A & (1 << UDRE0)) == 0) {
        }
        UDR0 = static_cast<uint8_t>(letter);
    }

    void print(const char *text)
    {
        for (; *text != '\0'; text++) {
            print(*text);
        }
    }

    void print(const __FlashStringHelper *text)
    {
        const char *place = reinterpret_cast<const char *>(text);
        for (char letter; (letter = static_cast<char>(pgm_read_byte(place))) != '\0'; place++) {
            print(letter);
        }
    }

    void print(double number, int digits)
    {
        if (number < 0) {
            print('-');
            number = -number;
        }
        double half = 0.5;
        for (int digit = 0; digit < digits; digit++) {
            half /= 10;
        }
        number += half;
        const unsigned long whole = static_cast<unsigned long>(number);
        char text[11];
        uint8_t place = sizeof text - 1;
        text[place] = '\0';
        unsigned long left = whole;
        do {
            text[--place] = static_cast<char>('0' + left % 10);
            left /= 10;
        } while (left > 0);
        print(&text[place]);
        if (digits > 0) {
            print('.');
        }
        double rest = number - static_cast<double>(whole);
        for (int digit = 0; digit < digits; digit++) {
            rest *= 10;
            const uint8_t next = static_cast<uint8_t>(rest);
            print(static_cast<char>('0' + next));
            rest -= next;
        }
    }

    void println() { print('\n'); }

    template <typename Text>
    void println(Text text)
    {
        print(text);
        println();
    }
};

static StubSerial Serial;

inline void delay(unsigned long) {}

void setup();
void loop();

int main()
{
    // Free RAM is painted, so that the deepest place of the stack shows.
    uint8_t *const top = reinterpret_cast<uint8_t *>(SP);
    for (uint8_t *place = &_end; place < top - 16; place++) {
        *place = 0xA5;
    }
    setup();
    loop();
    uint16_t free = 0;
    while (*(&_end + free) == 0xA5) {
        free++;
    }
    Serial.print(F("bytes of RAM left: "));
    Serial.print(static_cast<double>(free), 0);
    Serial.println();
    cli();
    sleep_enable();
    sleep_cpu();
    return 0;
}

#endif
