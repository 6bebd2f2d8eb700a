"""Sine-cosine pairs and the angle of a point for both number types, as routines that every language prints.

One operation a statement: all languages compute the same bits. Functions that look at the bits of numbers (the square
root; in C, selections and signs of the double arc tangent) stay with the languages that have no better way.

The sine-cosine pairs have no branch, comparison, conversion or integer, so that a loop over a pair turns into vector
code; what they promise is in `kinegen.backends.scalar_types`. Arc tangents share signs and selections and differ in
polynomials and constants: that of floats is minimax for the relative error up to tan(pi/8) (7.2e-10), that of doubles
up to 0.5464 (2.0e-18). `backends/scalar_types.py` states their errors.
"""

from __future__ import annotations

from kinegen.ir.routine_notation import read_routine

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


_CODE = """
# The point is turned into the first quadrant, and into its lower half.
sign_x = x < 0.0 ? -1.0 : 1.0
sign_y = y < 0.0 ? -1.0 : 1.0
width = x * sign_x
height = y * sign_y
large = width < height ? height : width
small = width < height ? width : height

# angle * sign_y = right * pi/8 + sign * (angle of the point (large, small)); right is 0, 4 or 8. Selections are
# not between 1 and another factor: compilers that see a factor of 1 make a branch of it, and no vectors.
flip = width < height ? -1.0 : 1.0
flat = width < height ? 0.0 : 4.0
sign = sign_x * flip
side = sign_x * flat
right = 4.0 - side

# That angle is atan(t), or pi/4 + atan(t) from a certain slope on. The smallest normal number, added to the
# divisor, keeps 0/0 away and is lost in any other sum; across is NaN if x or y is infinite.
half_large = large * 0.5
half_small = small * 0.5
bound = large * {slope}
twice = bound < small ? 2.0 : 0.0
across = half_large * twice
along = half_small * twice
dividend = small - across
total = large + along
divisor = total + {smallest}
t = dividend / divisor

{polynomial}

# base + low = parts * pi/8, base without rounding; the sum of base and t is rounded, and the rest added.
turn = sign * twice
parts = right + turn
base = parts * {part}
low = parts * {rest}
signed_t = sign * t
signed_tail = sign * tail
rough = base + signed_t
back = rough - base
lost = signed_t - back
small0 = lost + low
rest = small0 + signed_tail
angle = rough + rest
signed_angle = angle * sign_y
return signed_angle
"""

ATAN2_DOUBLE = read_routine(
    "atan2",
    ("y", "x"),
    _CODE.format(
        slope="0.5463",
        smallest="2.2250738585072014e-308",
        part="0.39269908169872414",
        rest="1.5308084989341915e-17",
        polynomial="""
# atan(t) = t + t * z * A(z); terms with even and odd powers of z apart, which a processor adds up side by side.
z = t * t
w = z * z
a13 = w * -0.0064409620097308365
a11 = a13 - 0.03466495380060364
a11w = a11 * w
a9 = a11w - 0.05199785276921586
a9w = a9 * w
a7 = a9w - 0.06665476747011981
a7w = a7 * w
a5 = a7w - 0.0909090377719635
a5w = a5 * w
a3 = a5w - 0.14285714281741374
a3w = a3 * w
a1 = a3w - 0.33333333333333176
a12 = w * 0.02038764715331689
a10 = a12 + 0.04482172758367528
a10w = a10 * w
a8 = a10w + 0.058720659343036295
a8w = a8 * w
a6 = a8w + 0.07692211229011013
a6w = a6 * w
a4 = a6w + 0.11111110922228634
a4w = a4 * w
a2 = a4w + 0.19999999999957793
a2z = a2 * z
a = a1 + a2z
tz = t * z
tail = tz * a
""",
    ),
)
"""Of doubles. C computes the same bits with bits instead of selections, and takes the polynomial from here."""

ATAN2_FLOAT = read_routine(
    "atan2",
    ("y", "x"),
    _CODE.format(
        slope="0.414213562",
        smallest="1.17549435e-38",
        part="0.392699122",
        rest="-4.07301713e-08",
        polynomial="""
# atan(t) = t + t * z * A(z).
z = t * t
a5 = z * -0.0609269701
a4 = a5 + 0.106001638
a4z = a4 * z
a3 = a4z - 0.142445102
a3z = a3 * z
a2 = a3z + 0.199985325
a2z = a2 * z
a1 = a2z - 0.333333164
tz = t * z
tail = tz * a1
""",
    ),
)
"""Of floats: a Cortex-M4F selects without jumps, and needs 69 instructions in all."""
