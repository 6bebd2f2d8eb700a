/* Compares the search for many targets with the one for a single target, bit by bit; prints what differs.
 * Given on the command line: REAL, NAME(f), JOINTS, where there are runtime parameters PARAMS, and for trees TIP_COUNT. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#ifdef PARAMS
#define ONE_SET &NAME(default_params),
#define SETS &NAME(default_params), 0,
#else
#define ONE_SET
#define SETS
#endif

#ifdef TIP_COUNT
#define TIP_STRIDE(columns) (columns) ? 12 * N : 16,
#define AS_MATRICES (REAL(*)[16])
#define AS_JACOBIANS (REAL(*)[6 * JOINTS])
#else
#define TIP_COUNT 1
#define TIP_STRIDE(columns)
#define AS_MATRICES
#define AS_JACOBIANS
#define IS_ARM
#endif

enum { N = 67 };

static REAL targets[N][16 * TIP_COUNT], columns[12 * TIP_COUNT][N], starts[N][JOINTS], wanted[N][JOINTS], q[N][JOINTS], rows[JOINTS][N + 3];
static NAME(found) wanted_found[N], found[N];
static unsigned char wanted_solved[N], solved[N + 1];

static void make(void)
{
    unsigned state = 1;
    for (int i = 0; i < N; i++) {
        REAL joints[JOINTS], jacobian[6 * JOINTS * TIP_COUNT];
        for (int j = 0; j < JOINTS; j++) {
            state = state * 1664525u + 1013904223u;
            joints[j] = (REAL)(state >> 8) / 50331648 + (REAL)0.4; /* within all limits */
            starts[i][j] = (REAL)(state & 1023) / 1024;
        }
#ifndef IS_ARM
        NAME(clamp)(joints, joints); /* fingers do not spread so far */
        for (int j = 0; j < JOINTS; j++) joints[j] *= (REAL)0.75;
#endif
        NAME(fk_jacobian)(joints, ONE_SET AS_MATRICES targets[i], AS_JACOBIANS jacobian);
        if (i % 9 == 4) targets[i][3] *= 100;          /* never reached */
        if (i % 9 == 5) targets[i][7] = (REAL)NAN;
        if (i % 9 == 6) targets[i][0] = (REAL)INFINITY;
        if (i % 9 == 7) starts[i][0] = (REAL)NAN;
        for (int entry = 0; entry < 12 * TIP_COUNT; entry++) columns[entry][i] = targets[i][16 * (entry / 12) + entry % 12];
    }
}

/* Whether the first n results are those that are wanted, and nothing else was written. */
static int same(int n, int layout)
{
    for (int i = 0; i < n; i++) {
        REAL own[JOINTS];
        for (int j = 0; j < JOINTS; j++) own[j] = (layout == 2) ? rows[j][i] : q[i][j];
        if (memcmp(own, wanted[i], sizeof own) != 0 || solved[i] != wanted_solved[i]) return 0;
        if (memcmp(&found[i], &wanted_found[i], sizeof found[i]) != 0) return 0;
    }
    return solved[n] == 7;
}

int main(void)
{
    NAME(search) search = NAME(default_search);
    int count = 0;
    make();
    search.restarts = 2;
#ifndef IS_ARM
    search.weights[0][1] = 0; /* the first tip is free to turn, the last one to go, and one counts half */
    search.weights[TIP_COUNT - 1][0] = (REAL)NAN;
    search.weights[TIP_COUNT / 2][0] = (REAL)0.5;
#endif
    for (int round = 0; round < 2; round++) {
        search.budget = (round == 0) ? 0 : 30;
        for (int i = 0; i < N; i++) {
            NAME(search) own = search;
            own.seed = search.seed + (uint32_t)(i + 5) * 2654435761U;
            wanted_solved[i] = (unsigned char)NAME(numeric_inverse)(targets[i], starts[i], ONE_SET &own, wanted[i], &wanted_found[i]);
            count += wanted_solved[i];
        }
        for (int n = 0; n <= N; n++) {
            for (int layout = 0; layout <= 2; layout += 2) {
                const int by_columns = (n + layout) % 3 == 0;
                memset(q, 7, sizeof q);
                memset(rows, 7, sizeof rows);
                memset(found, 7, sizeof found);
                memset(solved, 7, sizeof solved);
                NAME(numeric_inverse_batch)((size_t)n, by_columns ? &columns[0][0] : &targets[0][0], by_columns ? 1 : 16 * TIP_COUNT, TIP_STRIDE(by_columns) by_columns ? N : 1,
                    &starts[0][0], JOINTS, 1, SETS &search, 5, (layout == 2) ? &rows[0][0] : &q[0][0], (layout == 2) ? N + 3 : JOINTS,
                    found, solved, layout);
                if (!same(n, layout)) printf("other results: n = %d, layout %d, budget %d\n", n, layout, (int)search.budget);
            }
        }
    }
    printf("%s\n", 2 * count > N ? "solved" : "too few are solved");
    return 0;
}
