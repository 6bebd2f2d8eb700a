/* The arithmetic of made-up kernels; the kernels themselves, which give and take arrays as emitted ones do, follow.
 * Before this text stands REAL, the number type.
 *
 * Number r of block f of result k is x[r % size] * (r + 1) + (f + k + offset), where x holds all inputs, one after the
 * other.
 */

/* Reads count numbers of an input. */
static void gather(const REAL *from, ptrdiff_t step, int count, REAL *x)
{
    for (int j = 0; j < count; ++j) x[j] = from[j * step];
}

/* Computes result k: its blocks have entries computed numbers, and a last row where more than those are stored. */
static void compute(const REAL *x, int size, int k, REAL offset, int blocks, int entries, int stored, REAL *out)
{
    for (int f = 0; f < blocks; ++f) {
        for (int r = 0; r < stored; ++r) {
            const REAL number = size == 0 ? (REAL)1 : x[r % size];
            out[stored * f + r] = r < entries ? number * (REAL)(r + 1) + ((REAL)(f + k) + offset) : (REAL)(r == 15);
        }
    }
}

/* Writes configuration i of a result in one of the layouts. */
static void scatter(const REAL *from, int numbers, int entries, int stored, ptrdiff_t i, REAL *out, ptrdiff_t stride,
                    int layout)
{
    ptrdiff_t next = 0;
    for (int n = 0; n < numbers; ++n) {
        if (layout == 0) out[i * stride + n] = from[n];
        else if (n % stored < entries && layout == 1) out[i * stride + next++] = from[n];
        else if (n % stored < entries) out[next++ * stride + i] = from[n];
    }
}
