/* Holds the emitted pair to its promise on every n-th angle of the first quarter turn around zero, and on the angles a
   quarter, a half and three quarters of a turn away.

   Prints the largest errors of a sine or cosine and of both together, in units of the last place, and the number of
   results that are beyond 1 or differ from the same angle in another quarter. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "kernels.c"

int main(int count, char **arguments)
{
    const double quarter = 1.5707963267948966;
    const long step = (count > 1) ? atol(arguments[1]) : 1;
    double worst = 0.0;
    double both = 0.0;
    long wrong = 0;
    for (long rest = -536870912L; rest < 536870912L; rest += step) {
        int32_t s;
        int32_t c;
        SINCOS((uint32_t)rest, &s, &c);
        const double x = (double)rest * (quarter / 1073741824.0);
        const double ds = fabs(s - sin(x) * 1073741824.0);
        const double dc = fabs(c - cos(x) * 1073741824.0);
        worst = (ds > worst) ? ds : worst;
        worst = (dc > worst) ? dc : worst;
        both = (ds * ds + dc * dc > both) ? ds * ds + dc * dc : both;
        wrong += (s > 1073741824) || (s < -1073741824) || (c > 1073741824) || (c < -1073741824);
        int32_t s1;
        int32_t c1;
        SINCOS((uint32_t)rest + 1073741824u, &s1, &c1);
        wrong += (s1 != c) || (c1 != -s);
        SINCOS((uint32_t)rest + 2147483648u, &s1, &c1);
        wrong += (s1 != -s) || (c1 != -c);
        SINCOS((uint32_t)rest + 3221225472u, &s1, &c1);
        wrong += (s1 != -c) || (c1 != s);
    }
    printf("%.6f %.6f %ld\n", worst, sqrt(both), wrong);
    return 0;
}
