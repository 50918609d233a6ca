"""Quadratic terms of the incremental potential: inertia, drag and gravity, as Warp kernels.

    E = sum_i w_i |x_i - t_i|^2 / 2 - m_i g . x_i

with weight w and target t. For an implicit Euler step w = m / dt^2 (1 + a dt), a the drag in 1/s, and
t = x_n + dt v_n / (1 + a dt).
"""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.kernel
def quadratic_value(
    x: wp.array(dtype=wp.vec3d),
    target: wp.array(dtype=wp.vec3d),
    weight: wp.array(dtype=wp.float64),
    mass: wp.array(dtype=wp.float64),
    gravity: wp.vec3d,
    energy: wp.array(dtype=wp.float64),
):
    """energy[0] += E."""
    i = wp.tid()
    d = x[i] - target[i]
    wp.atomic_add(energy, 0, wp.float64(0.5) * weight[i] * wp.dot(d, d) - mass[i] * wp.dot(gravity, x[i]))


@wp.kernel
def quadratic_gradient(
    x: wp.array(dtype=wp.vec3d),
    target: wp.array(dtype=wp.vec3d),
    weight: wp.array(dtype=wp.float64),
    mass: wp.array(dtype=wp.float64),
    gravity: wp.vec3d,
    gradient: wp.array(dtype=wp.vec3d),
):
    """gradient += dE/dx."""
    i = wp.tid()
    gradient[i] = gradient[i] + (x[i] - target[i]) * weight[i] - gravity * mass[i]


@wp.kernel
def step_along(
    x: wp.array(dtype=wp.vec3d), p: wp.array(dtype=wp.vec3d), t: wp.float64, out: wp.array(dtype=wp.vec3d)
):
    """out = x + t p."""
    i = wp.tid()
    out[i] = x[i] + p[i] * t
