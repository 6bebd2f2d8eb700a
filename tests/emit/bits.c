/* Prints a hash of what the kernels of the SCARA return, called one by one and in batches, and how many results are NaN
   where an angle is bad. Needs: REAL, NAME(f) for the functions of this number type, and the headers. */
#include <stdio.h>
#include <string.h>

enum { COUNT = 100, BRANCHES = SCARA_BRANCHES, DOF = SCARA_DOF };

static unsigned long long hash = 14695981039346656037ULL;

static void take(const REAL *numbers, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        unsigned long long bits = 0;
        memcpy(&bits, &numbers[i], sizeof numbers[i]);
        hash = (hash ^ bits) * 1099511628211ULL;
    }
}

static void take_truths(const uint8_t *truths, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        const REAL number = (REAL)truths[i];
        take(&number, 1);
    }
}

static unsigned state = 1u;

/* From -3 to 3. */
static REAL draw(void)
{
    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return ((REAL)(state >> 8) / (REAL)8388608 - 1) * 3;
}

int main(void)
{
    static REAL q[COUNT][DOF], poses[COUNT][16], batch[COUNT][16], angles[COUNT][3];
    static REAL solutions[COUNT][BRANCHES][DOF];
    static uint8_t valid[COUNT][BRANCHES];
    for (int i = 0; i < COUNT; i++) {
        for (int j = 0; j < DOF; j++) {
            /* Multiples of 45 degrees and zeros of both signs, where signs and branches are decided; then anything. */
            const REAL special = (REAL)((i + j) % 5 - 2) * (REAL)0.785398163397448;
            q[i][j] = (i == 0) ? -(REAL)0.0 : (i < 20) ? special : draw();
        }
        REAL quaternion[4], found[DOF];
        NAME(fk)(q[i], poses[i]);
        NAME(quaternion_wxyz)(q[i], quaternion);
        NAME(rpy_zyx)(q[i], angles[i]);
        NAME(inverse)(poses[i], solutions[i], valid[i]);
        NAME(found) how;
        const int solved = NAME(numeric_inverse)(poses[i], q[(i + 1) % COUNT], &NAME(default_search), found, &how);
        const REAL counted = (REAL)(how.iterations + 1000 * solved);
        take(poses[i], 16);
        take(quaternion, 4);
        take(angles[i], 3);
        take(&solutions[i][0][0], BRANCHES * DOF);
        take_truths(valid[i], BRANCHES);
        take(found, DOF);
        take(&counted, 1);
    }
    NAME(fk_batch)(COUNT, &q[0][0], DOF, 1, &batch[0][0], 16, 0);
    take(&batch[0][0], COUNT * 16);
    NAME(rpy_zyx_batch)(COUNT, &q[0][0], DOF, 1, &angles[0][0], 3, 0);
    take(&angles[0][0], COUNT * 3);
    NAME(inverse_batch)(COUNT, &batch[0][0], 16, 1, &solutions[0][0][0], BRANCHES * DOF, &valid[0][0], BRANCHES, 0);
    take(&solutions[0][0][0], COUNT * BRANCHES * DOF);
    take_truths(&valid[0][0], COUNT * BRANCHES);

    int bad = 0;
    const volatile REAL zero = 0;
    const REAL angle[] = {zero / zero, 1 / zero, -1 / zero, (REAL)1e6};
    for (int i = 0; i < 4; i++) {
        REAL joints[DOF] = {angle[i], angle[i], 0}, pose[16];
        NAME(fk)(joints, pose);
        for (int entry = 0; entry < 16; entry++) {
            bad += pose[entry] != pose[entry];
        }
    }
    const REAL tests[] = {NAME(selftest)(), NAME(selftest_inverse)(), NAME(selftest_sincos)()};
    take(tests, 3);
    printf("%016llx %d\n", hash, bad);
    return 0;
}
