// As much of Arduino's core as the examples use, for a host: prints go to stdout, and loop() runs twice.
#ifndef STUB_ARDUINO_H
#define STUB_ARDUINO_H

#include <cstdio>

#define F(text) text

struct StubSerial {
    bool begun = false;

    void begin(long) { begun = true; }
    void print(const char *text) { std::fputs(begun ? text : "not begun", stdout); }
    void print(char letter) { std::putchar(letter); }
    void print(double number, int digits) { std::printf("%.*f", digits, number); }
    void println() { std::putchar('\n'); }
    void println(const char *text) { std::puts(text); }
};

static StubSerial Serial;

inline void delay(unsigned long) {}

void setup();
void loop();

int main()
{
    setup();
    loop();
    loop();
    return 0;
}

#endif
