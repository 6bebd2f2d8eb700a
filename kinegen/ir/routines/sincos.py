"""The sine-cosine pairs of both number types.

One operation per statement, and no branch, comparison, conversion or integer: the bits are the same in every language,
and a loop over a pair turns into vector code. What they promise stands in `kinegen.emit.sincos`.
"""

from __future__ import annotations

from kinegen.ir.routines.notation import read_routine

SINCOS_DOUBLE = read_routine(
    "sincos",
    ("x",),
    """
# The first product overflows just beyond 1e5; its infinity makes everything after it NaN.
scaled = x * 1.7976931348623158e+303
turns = scaled * 3.5413150332597764e-304

# k: the nearest multiple of pi/2. Adding 1.5 * 2^52 rounds to an integer.
shifted = turns + 6755399441055744.0
k = shifted - 6755399441055744.0

# r + rl = x - k * pi/2, pi/2 in three parts; the first two products and the first difference are exact.
part1 = k * 1.5707963267923333
part2 = k * 2.5633441512663184e-12
part3 = k * 3.2820035428735005e-22
rough = x - part1
r = rough - part2
lost1 = rough - r
lost2 = lost1 - part2
rl = lost2 - part3

# cos(r + rl) = w + (rounding error of w - r * rl + z^2 * C(z)), w = 1 - z/2, |r| <= pi/4.
z = r * r
half = z * 0.5
w = 1.0 - half
up = 1.0 - w
dw = up - half
rrl = r * rl
low_c = dw - rrl
c6 = z * -1.1359938741538309e-11
c5 = c6 + 2.0875729395041473e-09
c5z = c5 * z
c4 = c5z - 2.755731440201029e-07
c4z = c4 * z
c3 = c4z + 2.4801587289675016e-05
c3z = c3 * z
c2 = c3z - 0.0013888888888874478
c2z = c2 * z
c1 = c2z + 0.0416666666666666
zz = z * z
quartic = zz * c1
tail_c = quartic + low_c
cos_r = w + tail_c

# sin(r + rl) = r + (rl * w + r * z * S(z)).
low_s = rl * w
s6 = z * 1.58959436374344e-10
s5 = s6 - 2.505074232064192e-08
s5z = s5 * z
s4 = s5z + 2.755731358226442e-06
s4z = s4 * z
s3 = s4z - 0.0001984126982945851
s3z = s3 * z
s2 = s3z + 0.008333333333321919
s2z = s2 * z
s1 = s2z - 0.1666666666666663
rz = r * z
cubic = rz * s1
tail_s = cubic + low_s
sin_r = r + tail_s

# sin(k pi/2) = k minus the nearest even number, ties going to multiples of 4; cos(k pi/2) is the same of k + 1.
# Adding 1.5 * 2^53 rounds to an even number in just this way.
even_s = k + 13510798882111488.0
near_s = even_s - 13510798882111488.0
sin_k = k - near_s
after = k + 1.0
even_c = after + 13510798882111488.0
near_c = even_c - 13510798882111488.0
cos_k = after - near_c

# The sum of the two angles; of each pair of products one is zero, so nothing is rounded.
ss = sin_r * cos_k
sc = cos_r * sin_k
cc = cos_r * cos_k
cs = sin_r * sin_k
sine = ss + sc
cosine = cc - cs
return sine, cosine
""",
)
"""Of doubles.

Worst cases: the double next to 29 pi/2 leaves |r| = 6.2e-19, smaller than for any other multiple up to 1e5 rad
(29 * 2^j leave the same number of good bits); the third part of pi/2 carries the reduction 120 bits below one.
"""

SINCOS_FLOAT = read_routine(
    "sincos",
    ("x",),
    """
# The first product overflows just beyond 12000; its infinity makes everything after it NaN.
scaled = x * 2.83568611e+34
turns = scaled * 2.24502905e-35

# k: the nearest multiple of pi/2. Adding 1.5 * 2^23 rounds to an integer.
shifted = turns + 12582912.0
k = shifted - 12582912.0

# x - k * pi/2 = r0 - part3, pi/2 in three parts; all but part3 is exact. r is the rounded difference, rl the rest.
part1 = k * 1.5703125
part2 = k * 0.000483751297
part3 = k * 7.54979013e-08
rough = x - part1
r0 = rough - part2
r = r0 - part3
lost = r0 - r
rl = lost - part3

# cos(r + rl) = w + (rounding error of w - r * rl + z^2 * C(z)), w = 1 - z/2, |r| <= pi/4.
z = r * r
half = z * 0.5
w = 1.0 - half
up = 1.0 - w
dw = up - half
rrl = r * rl
low_c = dw - rrl
c3 = z * 2.44331695e-05
c2 = c3 - 0.00138873141
c2z = c2 * z
c1 = c2z + 0.0416666456
zz = z * z
quartic = zz * c1
tail_c = quartic + low_c
cos_r = w + tail_c

# sin(r0 - part3) = r0 + (r * z * S(z) - part3).
s3 = z * -0.000195182845
s2 = s3 + 0.00833218917
s2z = s2 * z
s1 = s2z - 0.166666552
rz = r * z
cubic = rz * s1
tail_s = cubic - part3
sin_r = r0 + tail_s

# sin(k pi/2) = k minus the nearest even number, ties going to multiples of 4; cos(k pi/2) is the same of k + 1.
# Adding 1.5 * 2^24 rounds to an even number in just this way.
even_s = k + 25165824.0
near_s = even_s - 25165824.0
sin_k = k - near_s
after = k + 1.0
even_c = after + 25165824.0
near_c = even_c - 25165824.0
cos_k = after - near_c

# The sum of the two angles; of each pair of products one is zero, so nothing is rounded.
ss = sin_r * cos_k
sc = cos_r * sin_k
cc = cos_r * cos_k
cs = sin_r * sin_k
sine = ss + sc
cosine = cc - cs
return sine, cosine
""",
)
"""Of floats."""
