/* What a program of `words.c` works through; `words.py` writes the table for each robot. */
#ifndef TABLE_H
#define TABLE_H

#include <stddef.h>

typedef struct {
    const char *name;
    size_t size;  /* bytes of a number */
    size_t given; /* numbers of a row */
    size_t found; /* numbers of its results */
    void (*run)(size_t rows, const void *given, void *found);
} table_entry;

extern const table_entry table[];
extern const size_t table_count;

#endif
