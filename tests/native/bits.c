/* Joint vectors on standard input, as they lie in memory; the poses of all kernels and layouts on standard output.
 *
 * Compiled with the kernels of a robot and the macros REAL, KERNEL(x) (a name with its prefix) and HEADER. The shapes
 * are those of an arm with 6 joint values.
 */
#include <stdio.h>
#include HEADER

enum { DOF = 6, MOST = 1000 };

static REAL q[MOST][DOF], turned[DOF][MOST], out[MOST * 16];

static void put(size_t numbers)
{
    if (fwrite(out, sizeof(REAL), numbers, stdout) != numbers) perror("writing");
}

int main(void)
{
    const size_t n = fread(q, sizeof(q[0]), MOST, stdin);
    for (size_t i = 0; i < n; ++i) {
        for (int j = 0; j < DOF; ++j) turned[j][i] = q[i][j];
        KERNEL(fk)(q[i], out + 16 * i);
    }
    put(16 * n);
    for (int layout = 0; layout < 3; ++layout) {
        const size_t numbers = layout == 0 ? 16 : 12;
        KERNEL(fk_batch)(n, q[0], DOF, 1, out, layout == 2 ? (ptrdiff_t)n : (ptrdiff_t)numbers, layout);
        put(numbers * n);
    }
    KERNEL(fk_batch)(n, turned[0], 1, MOST, out, (ptrdiff_t)n, 2);
    put(12 * n);
    return 0;
}
