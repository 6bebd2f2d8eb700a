"""A program in integers: the same statements in the same order, each with the scale of its result.

`value_classes` tells angles, numbers and lengths apart and refuses what integers cannot do; `plan` chooses scales,
`writer` writes integer statements; `ranges` bounds sizes and errors, for every input whatsoever; `program` holds the
result. A plan that could overflow does not exist: every value is shown to fit before the plan is handed on.

Scales. An angle is an unsigned binary angle: 2^32 is one turn, so sums wrap as angles do. A number (an entry of a
rotation, a sine) has `NUMBER_BITS` fraction bits; a length has as many as the reach leaves. Inputs that are lengths
have a scale of their own, finer than that, which makes every int32_t a valid input.
"""
