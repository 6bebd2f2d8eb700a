"""The functions of a package in JAX; run with the package on the path."""

import jax
import jax.numpy as jnp
import ur5.jax

jax.config.update("jax_enable_x64", True)


def height(q):  # noqa: ANN001, ANN201 - JAX's arrays have no type of their own
    """The height of the tool."""
    return ur5.jax.fk(q)[2, 3]


q = jnp.array([0.1, -1.2, 0.9, 0.3, 0.5, -0.4])
print("height:", jax.jit(height)(q).round(6))
print("slope:", jax.jit(jax.grad(height))(q).round(6))
print("curvature:", jnp.trace(jax.jit(jax.hessian(height))(q)).round(6))
print("batch:", jax.jit(jax.vmap(jax.value_and_grad(height)))(jnp.zeros((1000, 6)))[1].shape)
