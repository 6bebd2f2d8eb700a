"""The kernels of a package inside JAX: under jit and vmap, with derivatives; run with the package on the path."""

import jax
import jax.numpy as jnp
import numpy as np
import ur5

jax.config.update("jax_enable_x64", True)


def called(kernel, shape, q):  # noqa: ANN001, ANN201 - JAX's arrays have no type of their own
    """Call a kernel on the host; a batch stays one call."""
    result = jax.ShapeDtypeStruct(q.shape[:-1] + shape, q.dtype)
    return jax.pure_callback(lambda values: kernel(np.asarray(values)), result, q, vmap_method="expand_dims")


@jax.custom_jvp
def position(q):  # noqa: ANN001, ANN201
    """Position of the tool (..., 3)."""
    return called(ur5.position, (3,), q)


@position.defjvp
def position_jvp(given, rates):  # noqa: ANN001, ANN201
    """Its derivative: the upper half of the Jacobian."""
    (q,), (qd,) = given, rates
    jacobian = called(ur5.jacobian, (6, 6), q)
    return position(q), jnp.einsum("...ij,...j->...i", jacobian[..., :3, :], qd)


def height(q):  # noqa: ANN001, ANN201
    """The height of the tool."""
    return position(q)[2]


q = jnp.array([0.1, -1.2, 0.9, 0.3, 0.5, -0.4])
print("height:", jax.jit(height)(q).round(6))
print("slope:", jax.jit(jax.jacfwd(height))(q).round(6))
print("batch:", jax.jit(jax.vmap(position))(jnp.zeros((1000, 6))).shape)
