/* One pose on a board: no heap, no libm. printf only shows the result here. */
#include "puma560.h"

#include <stdio.h>

int main(void)
{
    const double q[PUMA560_DOF] = {0.0, -0.5, 0.25, 0.0, 1.0, 0.0};
    double base_T_tool[16];

    puma560_fk(q, base_T_tool);
    for (int row = 0; row < 3; ++row) {
        const double *const entry = &base_T_tool[4 * row];
        printf("%9.6f %9.6f %9.6f %9.6f\n", entry[0], entry[1], entry[2], entry[3]);
    }
    return 0;
}
