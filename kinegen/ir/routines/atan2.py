"""The angles of a point for both number types.

Signs and selections are the same, polynomials and constants differ: that of floats is minimax for the relative error
up to tan(pi/8) (7.2e-10), that of doubles up to 0.5464 (2.0e-18). What they promise stands in `kinegen.emit.functions`.
"""

from __future__ import annotations

from kinegen.ir.routines.notation import read_routine

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
