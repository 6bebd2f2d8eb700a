/* words IN OUT: runs every entry of the table on the rows of numbers in IN, and writes the words of all results to OUT.
 *
 * IN holds for each entry the number of rows, in eight bytes, and then the rows; OUT holds the results one after the
 * other. Where a result is not written, it keeps the byte with which OUT is filled beforehand.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "table.h"

static void fail(const char *reason)
{
    (void)fprintf(stderr, "%s\n", reason);
    exit(1);
}

int main(int argc, char **argv)
{
    FILE *from = (argc > 2) ? fopen(argv[1], "rb") : NULL;
    FILE *to = (argc > 2) ? fopen(argv[2], "wb") : NULL;
    if ((from == NULL) || (to == NULL)) {
        fail("cannot open the files");
    }
    for (size_t i = 0; i < table_count; ++i) {
        const table_entry *entry = &table[i];
        unsigned char size[8];
        size_t rows = 0;
        if (fread(size, 1, 8, from) != 8) {
            fail("cannot read the number of rows");
        }
        for (int byte = 7; byte >= 0; --byte) {
            rows = (rows << 8) | size[byte];
        }
        /* One number more, since an array of none has no address. */
        unsigned char *given = malloc((rows * entry->given + 1) * entry->size);
        unsigned char *found = malloc((rows * entry->found + 1) * entry->size);
        if ((given == NULL) || (found == NULL)) {
            fail("no memory");
        }
        if (fread(given, entry->size, rows * entry->given, from) != rows * entry->given) {
            fail("cannot read the rows");
        }
        memset(found, 0x5A, (rows * entry->found + 1) * entry->size);
        entry->run(rows, given, found);
        if (found[rows * entry->found * entry->size] != 0x5A) {
            fail(entry->name);
        }
        if (fwrite(found, entry->size, rows * entry->found, to) != rows * entry->found) {
            fail("cannot write");
        }
        free(given);
        free(found);
    }
    return fclose(to);
}
