"""The printed closed form as a function of JAX; run with the printout beside it, as ur5_closed_form.py."""

import jax
import jax.numpy as jnp
import ur5_closed_form

jax.config.update("jax_enable_x64", True)
ur5_closed_form.math = jnp  # the printout takes its sines and cosines from math


def position(q):  # noqa: ANN001, ANN201 - JAX's arrays have no type of their own
    """Position of the tool (3,)."""
    return jnp.array(ur5_closed_form.base_T_tool(q))[:3, 3]


q = jnp.array([0.1, -1.2, 0.9, 0.3, 0.5, -0.4])
print("position:", jax.jit(position)(q).round(6))
print("gradient of the height:", jax.grad(lambda q: position(q)[2])(q).round(6))
