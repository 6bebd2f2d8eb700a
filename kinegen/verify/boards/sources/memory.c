/* What compilers call to clear and copy arrays, in freestanding programs too. Every firmware project has them; programs
 * for the boards are linked without a C library. Through volatile pointers no compiler makes calls of itself of them.
 */
#include <stddef.h>

void *memset(void *to, int value, size_t size);
void *memcpy(void *to, const void *from, size_t size);

void *memset(void *to, int value, size_t size)
{
    volatile unsigned char *bytes = to;
    for (size_t place = 0; place < size; place++) {
        bytes[place] = (unsigned char)value;
    }
    return to;
}

void *memcpy(void *to, const void *from, size_t size)
{
    volatile unsigned char *bytes = to;
    const unsigned char *source = from;
    for (size_t place = 0; place < size; place++) {
        bytes[place] = source[place];
    }
    return to;
}
