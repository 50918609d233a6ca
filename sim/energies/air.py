"""Drag of still or moving air on every triangle, as Warp kernels.

A triangle of area A and unit normal n that moves through air of density rho, which itself moves at w, meets
it at v = v_triangle - w and is pushed with

    f = -1/2 rho A (C_n |v . n| (v . n) n + C_t |v_t| v_t),   v_t = v - (v . n) n.

Over a step of dt from x_n it is the gradient of

    E(x) = dt/2 (a (u . n)^2 + b |u - (u . n) n|^2),   u = (xbar - xbar_n) / dt - w,
    a = 1/2 rho C_n A |v . n|,   b = 1/2 rho C_t A |v_t|,

xbar the triangle's centroid, with n, A, a and b those of the step's start: implicit in the velocity that
drives the force, so that thin cloth in a strong wind stays stable, quadratic and convex in x, and of first
order in dt, as the time step is.
Every corner takes a third. Both sides of a triangle count once, and nothing lies in the lee of anything.

Source: the pressure and friction drag of a flat plate (Hoerner 1965, "Fluid-dynamic drag"); linearised in
time as the friction of Li et al. 2020 is.
"""

import warp as wp

from muslin.sim.solve.block_matrix import BlockMatrix

wp.set_module_options({"enable_backward": False})


@wp.struct
class AirModel:
    """Faces, their slots in the matrix, and of a step's start: `normal` n, `across` a and `along` b, kg/s."""

    faces: wp.array(dtype=wp.vec3i)
    slots: wp.array2d(dtype=wp.int32)
    normal: wp.array(dtype=wp.vec3d)
    across: wp.array(dtype=wp.float64)
    along: wp.array(dtype=wp.float64)
    wind: wp.vec3d


@wp.func
def relative_velocity(
    x: wp.array(dtype=wp.vec3d),
    start: wp.array(dtype=wp.vec3d),
    face: wp.vec3i,
    wind: wp.vec3d,
    inverse_dt: wp.float64,
) -> wp.vec3d:
    """u = (xbar - xbar_n) / dt - w."""
    moved = (x[face[0]] - start[face[0]]) + (x[face[1]] - start[face[1]]) + (x[face[2]] - start[face[2]])
    return moved * (inverse_dt / wp.float64(3.0)) - wind


@wp.kernel
def air_begin_step(
    x: wp.array(dtype=wp.vec3d),
    velocity: wp.array(dtype=wp.vec3d),
    pressure: wp.float64,
    friction: wp.float64,
    model: AirModel,
):
    """Freeze n, a and b of every face; `pressure` = rho C_n / 2, `friction` = rho C_t / 2, kg/m^3."""
    f = wp.tid()
    face = model.faces[f]
    double = wp.cross(x[face[1]] - x[face[0]], x[face[2]] - x[face[0]])
    area = wp.float64(0.5) * wp.length(double)
    n = wp.normalize(double)
    v = (velocity[face[0]] + velocity[face[1]] + velocity[face[2]]) / wp.float64(3.0) - model.wind
    vn = wp.dot(v, n)
    model.normal[f] = n
    model.across[f] = pressure * area * wp.abs(vn)
    model.along[f] = friction * area * wp.length(v - n * vn)


@wp.kernel
def air_value(
    x: wp.array(dtype=wp.vec3d),
    start: wp.array(dtype=wp.vec3d),
    model: AirModel,
    inverse_dt: wp.float64,
    energy: wp.array(dtype=wp.float64),
):
    """energy[0] += sum over faces of E."""
    f = wp.tid()
    u = relative_velocity(x, start, model.faces[f], model.wind, inverse_dt)
    un = wp.dot(u, model.normal[f])
    value = model.across[f] * un * un + model.along[f] * (wp.dot(u, u) - un * un)
    wp.atomic_add(energy, 0, wp.float64(0.5) * value / inverse_dt)


@wp.kernel
def air_derivatives(
    x: wp.array(dtype=wp.vec3d),
    start: wp.array(dtype=wp.vec3d),
    model: AirModel,
    inverse_dt: wp.float64,
    gradient: wp.array(dtype=wp.vec3d),
    matrix: BlockMatrix,
):
    """Adds the gradient, N, and the Hessian blocks, N/m: exact, and positive semi-definite."""
    f = wp.tid()
    face = model.faces[f]
    n = model.normal[f]
    a = model.across[f]
    b = model.along[f]
    u = relative_velocity(x, start, face, model.wind, inverse_dt)
    third = wp.float64(1.0) / wp.float64(3.0)
    force = (u * b + n * ((a - b) * wp.dot(u, n))) * third
    block = wp.outer(n * (a - b), n) + wp.identity(n=3, dtype=wp.float64) * b
    block = block * (inverse_dt / wp.float64(9.0))
    for i in range(int(0), int(3)):
        wp.atomic_add(gradient, face[i], force)
        wp.atomic_add(matrix.diagonal, face[i], block)
        wp.atomic_add(matrix.values, model.slots[f, i], block)
