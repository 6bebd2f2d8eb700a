/* Configurations whose numbers go beyond 2^32, in memory that is reserved and touched only where they lie.
 *
 * Compiled with the batch kernels of the PUMA 560, their loops made to begin at configuration far_begin instead of 0;
 * the tile that they begin with is not looked at. Ends with status 77 where so many addresses cannot be had.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "puma560.h"
#include "puma560_batch.h"

enum { DOF = PUMA560_DOF, TAIL = 100 };

extern size_t far_begin;
size_t far_begin;

static double *reserve(size_t numbers)
{
    const int how = MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE;
    void *const memory = mmap(NULL, numbers * sizeof(double), PROT_READ | PROT_WRITE, how, -1, 0);
    if (memory == MAP_FAILED) exit(77);
    return memory;
}

/* Numbers between the beginning of an array and its farthest element. */
static size_t reach(size_t n, ptrdiff_t stride, size_t m, ptrdiff_t other)
{
    return (n - 1) * (size_t)llabs(stride) + (m - 1) * (size_t)llabs(other) + 1;
}

static void check(size_t begin, size_t n, ptrdiff_t q_pose, ptrdiff_t q_joint, ptrdiff_t out_stride, int layout)
{
    const size_t rows = layout == 0 ? 16 : 12;
    const size_t q_length = reach(n, q_pose, DOF, q_joint);
    const size_t out_length = layout == 2 ? reach(n, 1, rows, out_stride) : reach(n, out_stride, rows, 1);
    double *const q_memory = reserve(q_length), *const out_memory = reserve(out_length);
    double *const q = q_pose < 0 ? q_memory + q_length - DOF : q_memory;
    double *const out = out_stride < 0 ? out_memory + out_length - rows : out_memory;
    double point[DOF], pose[16];

    for (size_t i = begin; i < n; ++i) {
        for (int j = 0; j < DOF; ++j) q[(ptrdiff_t)i * q_pose + j * q_joint] = (double)(i % 1001) / 300 - j;
    }
    puma560_fk_batch(n, q, q_pose, q_joint, out, out_stride, layout);
    for (size_t i = begin; i < n; ++i) {
        for (int j = 0; j < DOF; ++j) point[j] = (double)(i % 1001) / 300 - j;
        puma560_fk(point, pose);
        for (size_t r = 0; r < rows; ++r) {
            const ptrdiff_t index = (ptrdiff_t)i, row = (ptrdiff_t)r;
            const double found = layout == 2 ? out[row * out_stride + index] : out[index * out_stride + row];
            if (memcmp(&found, &pose[r], sizeof(found)) != 0) {
                printf("configuration %zu of %zu, number %zu, layout %d\n", i, n, r, layout);
                exit(1);
            }
        }
    }
    munmap(q_memory, q_length * sizeof(double));
    munmap(out_memory, out_length * sizeof(double));
}

/* The batches that begin at far_begin, in every layout. */
static void check_layouts(void)
{
    const size_t n = far_begin + TAIL, checked = far_begin == 0 ? 0 : far_begin + TAIL / 2;
    for (int layout = 0; layout < 3; ++layout) {
        const ptrdiff_t stride = layout == 0 ? 16 : layout == 1 ? 12 : (ptrdiff_t)n;
        check(checked, n, DOF, 1, stride, layout);
        check(checked, n, 1, (ptrdiff_t)n, stride, layout);
    }
}

int main(void)
{
    const size_t two = 2;
    const size_t begins[] = {0, (two << 30) - 64, (two << 31) - 64, two << 32};
    for (size_t i = 0; i < sizeof(begins) / sizeof(begins[0]); ++i) {
        far_begin = begins[i];
        check_layouts();
    }

    /* Neighbours that lie far apart. */
    const ptrdiff_t distance = ((ptrdiff_t)1 << 32) + 7;
    far_begin = 0;
    check(0, TAIL, distance, 1, distance, 0);
    check(0, TAIL, -distance, 1, -distance, 0);
    check(0, TAIL, 1, distance, distance, 2);
    printf("clean\n");
    return 0;
}
