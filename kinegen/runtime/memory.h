/* Memory of large results, which later results use again.
 *
 * The system clears each page that a process gets, and a program that asks for a hundred megabytes in every call spends
 * most of its time on that. So the memory of a few large results is kept when they go, and lent to the system meanwhile
 * (MADV_FREE): it takes the pages when memory is short, and otherwise the next large result finds them as they were,
 * written and not cleared. Tools that show the memory of a process count such pages as its own until they are taken.
 * NumPy knows these functions as the handler of an array, so results own their memory as any array does.
 */
#ifndef KINEGEN_KINEGEN_MEMORY_H_INCLUDED
#define KINEGEN_KINEGEN_MEMORY_H_INCLUDED

#include "kinegen_arrays.h"
#include <string.h>

#if defined(__linux__) && defined(NPY_1_22_API_VERSION)
#include <sys/mman.h>
#ifdef MADV_FREE
#define KEEPS_MEMORY 1
#endif
#endif

#ifdef KEEPS_MEMORY

/* Blocks begin at huge pages, and are a whole number of them. */
#define HUGE_PAGE ((size_t)1 << 21)
/* What lies in front of a block: its length. It is a whole number of pages on all processors. */
#define FRONT ((size_t)1 << 16)
/* So many blocks are kept, none larger than this. */
#define SPARES 4
#define LARGEST_SPARE ((size_t)1 << 30)

static void *spares[SPARES];
static unsigned turn;

static size_t *length_of(void *block)
{
    return (size_t *)(void *)((char *)block - FRONT);
}

static void give_back(void *block)
{
    munmap((char *)block - FRONT, *length_of(block) + FRONT);
}

/* A new block of `length` bytes, or NULL. */
static void *map_block(size_t length)
{
    const size_t whole = length + 2 * HUGE_PAGE;
    char *const start = whole < length ? MAP_FAILED
                                       : mmap(NULL, whole, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    char *block;
    if (start == MAP_FAILED) return NULL;
    block = (char *)(((uintptr_t)start + FRONT + HUGE_PAGE - 1) / HUGE_PAGE * HUGE_PAGE);
    if (block - FRONT != start) munmap(start, (size_t)(block - FRONT - start));
    munmap(block + length, (size_t)(start + whole - (block + length)));
    madvise(block, length, MADV_HUGEPAGE);
    *length_of(block) = length;
    return block;
}

/* A kept block for `length` bytes that is not much larger, or NULL. */
static void *take_spare(size_t length)
{
    for (int i = 0; i < SPARES; ++i) {
        void *const block = __atomic_exchange_n(&spares[i], NULL, __ATOMIC_ACQ_REL);
        void *nothing = NULL;
        if (block == NULL) continue;
        if (*length_of(block) >= length && *length_of(block) / 2 <= length) return block;
        if (!__atomic_compare_exchange_n(&spares[i], &nothing, block, 0, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE)) {
            give_back(block);
        }
    }
    return NULL;
}

static void *take_memory(void *context, size_t size)
{
    const size_t length = (size + HUGE_PAGE - 1) / HUGE_PAGE * HUGE_PAGE;
    void *block;
    (void)context;
    if (length < size) return NULL;
    block = take_spare(length);
    return block == NULL ? map_block(length) : block;
}

static void leave_memory(void *context, void *block, size_t size)
{
    void *older;
    (void)context;
    (void)size;
    if (block == NULL) return;
    if (*length_of(block) > LARGEST_SPARE || madvise(block, *length_of(block), MADV_FREE) != 0) {
        give_back(block);
        return;
    }
    older = __atomic_exchange_n(&spares[__atomic_fetch_add(&turn, 1, __ATOMIC_RELAXED) % SPARES], block, __ATOMIC_ACQ_REL);
    if (older != NULL) give_back(older);
}

static void *take_cleared(void *context, size_t count, size_t size)
{
    void *const block = size != 0 && count > (size_t)-1 / size ? NULL : take_memory(context, count * size);
    return block == NULL ? NULL : memset(block, 0, count * size);
}

static void *take_other(void *context, void *block, size_t size)
{
    void *other;
    if (block != NULL && *length_of(block) >= size) return block;
    other = take_memory(context, size);
    if (other != NULL && block != NULL) {
        memcpy(other, block, *length_of(block));
        leave_memory(context, block, 0);
    }
    return other;
}

static PyDataMem_Handler results_handler = {
    "kinegen", 1, {NULL, take_memory, take_cleared, take_other, leave_memory}};

#endif
#endif
