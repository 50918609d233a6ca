"""Eigenfunctions of the Laplace-Beltrami operator of a mesh: what sines are to a line, in its rest metric."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import igl
import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import LinearOperator, SuperLU, eigsh, splu

from muslin.eval.metrics.checks import check_faces, checked_corners, corner_areas
from muslin.garments.errors import InputError
from muslin.garments.half_edges import half_edges, on_boundary

SLICE = 60  # eigenpairs that are sought together; the Lanczos basis of twice as many is what costs
DENSE = 700  # vertices up to which a dense solver is faster
START = 0  # seed of the Lanczos vectors
ATTEMPTS = 3  # at cutting the spectrum, before the dense solver
MOST = 3000  # eigenfunctions; more are asked for by a wrong unit


@dataclass(frozen=True, eq=False)
class HarmonicBasis:
    """All eigenfunctions of K phi = lambda M phi with wavelengths 2 pi / sqrt(lambda) >= `shortest`, metres.

    faces         (F, 3)
    mass          (V,), m^2: diagonal of M, a third of the area of each triangle at a vertex
    eigenvalues   (k,), 1/m^2, rising from 0
    functions     (V, k), 1/m: phi_i . M phi_j = 1 if i = j, else 0
    stiffness     K (V, V): (K x)_i = 1/2 sum_j (cot a_ij + cot b_ij) (x_i - x_j), no unit
    shortest      metres
    """

    faces: np.ndarray
    mass: np.ndarray
    eigenvalues: np.ndarray
    functions: np.ndarray
    stiffness: csc_array
    shortest: float

    @property
    def area(self) -> float:
        """Square metres."""
        return float(self.mass.sum())

    @property
    def wavelengths(self) -> np.ndarray:
        """2 pi / sqrt(lambda); (k,), metres, infinite for the constants."""
        constant = self.component_count
        return np.concatenate([np.full(constant, np.inf), 2.0 * np.pi / np.sqrt(self.eigenvalues[constant:])])

    @cached_property
    def laplacian(self) -> csr_array:
        """-Laplace (V, V), 1/m^2: M^-1 K at inner vertices; at those on a boundary the mean of their inner
        neighbours, or of their filled ones where all lie on the boundary.

        There (K x) is the slope across the open edge, which is no second derivative.
        """
        boundary = np.zeros(len(self.mass), dtype=bool)
        half = half_edges(self.faces.astype(np.int32))
        boundary[half[on_boundary(self.faces.astype(np.int32))]] = True
        filled = ~boundary
        found = diags_array(filled / self.mass) @ self.stiffness
        ones = np.ones(len(half))
        neighbours = csr_array((ones, (half[:, 0], half[:, 1])), shape=self.stiffness.shape)
        neighbours = neighbours.maximum(neighbours.T)
        for _ in range(2):
            count = neighbours @ filled.astype(np.float64)
            reached = ~filled & (count > 0.0)
            found += (
                diags_array(reached / np.maximum(count, 1.0)) @ neighbours @ diags_array(1.0 * filled) @ found
            )
            filled |= reached
        return csr_array(found)

    @cached_property
    def components(self) -> np.ndarray:
        """(V,) piece of the mesh that a vertex belongs to."""
        return connected_components(self.stiffness, directed=False)[1]

    @property
    def component_count(self) -> int:
        """Pieces of the mesh: as many eigenfunctions are constant."""
        return int(self.components.max()) + 1

    def coefficients(self, values: np.ndarray) -> np.ndarray:
        """c_i = phi_i . M x of values x (..., V, d); (..., k, d)."""
        # One product for all frames: it has to read the functions once only.
        columns = np.moveaxis(values, -2, 0).reshape(len(self.mass), -1)
        found = self.functions.T @ (self.mass[:, None] * columns)
        return np.moveaxis(found.reshape(-1, *values.shape[:-2], values.shape[-1]), 0, -2)


def harmonic_basis(faces: np.ndarray, rest: np.ndarray, shortest: float = 0.1) -> HarmonicBasis:
    """Laplace-Beltrami basis of a mesh, down to a wavelength; kept for the last meshes that were asked for.

        K_ij = -1/2 (cot a_ij + cot b_ij),   M_ii = 1/3 sum of the areas of the triangles at i

    with natural boundary conditions. By Weyl's law there are about pi A / shortest^2 functions on an area A:
    250 on a t-shirt for 0.1 m.

    faces      (F, 3), sewn
    rest       corners of each face at rest, (F, 3, 2) in panel space, or (F, 3, 3), metres; so the metric is
               that of the cloth, whatever pose it is in. Without panels, the corners of a frame of the truth.
    shortest   metres; a basis of wavelengths below twice the edges is that of the mesh, not of the cloth

    Eigenvalues are counted by the signs of the pivots of K - s M (Sylvester), and found by shifted and
    inverted Lanczos iterations in slices of about SLICE; so none is missed.

    Raises InputError for faces and corners that do not match, are not finite or have no area, for vertices
    without a face, and for more than MOST functions.

    Sources: Pinkall, Polthier 1993 (cotangents); Vallet, Levy 2008 (manifold harmonics, band by band).
    """
    check_faces(faces, int(faces.max(initial=0)) + 1, "harmonic basis")
    corners = checked_corners(rest, len(faces), "harmonic basis")
    if not (np.isfinite(shortest) and shortest > 0.0):
        raise InputError(
            f"harmonic basis: shortest = {shortest} m is not allowed; give a positive wavelength"
        )
    return _kept(faces.astype(np.int64).tobytes(), corners.tobytes(), corners.shape[2], shortest)


@lru_cache(maxsize=8)
def _kept(faces: bytes, corners: bytes, dimensions: int, shortest: float) -> HarmonicBasis:
    f = np.frombuffer(faces, dtype=np.int64).reshape(-1, 3)
    c = np.frombuffer(corners, dtype=np.float64).reshape(-1, 3, dimensions)
    mass = np.bincount(f.ravel(), np.repeat(corner_areas(c) / 3.0, 3))
    if not (mass > 0.0).all():
        raise InputError(f"harmonic basis: vertex {int(np.argmin(mass))} belongs to no face; remove it")
    # Opposite each corner, in the order that igl takes them.
    sides = np.stack(
        [np.linalg.norm(c[:, (k + 2) % 3] - c[:, (k + 1) % 3], axis=1) for k in range(3)], axis=1
    )
    stiffness = csc_array(-igl.cotmatrix_intrinsic(sides, f))
    root = np.sqrt(mass)
    scaled = csc_array(diags_array(1.0 / root) @ stiffness @ diags_array(1.0 / root))
    values, vectors = _below(scaled, (2.0 * np.pi / shortest) ** 2)
    return HarmonicBasis(f, mass, np.maximum(values, 0.0), vectors / root[:, None], stiffness, shortest)


def _below(matrix: csc_array, limit: float) -> tuple[np.ndarray, np.ndarray]:
    """All eigenvalues (k,) below a limit, rising, and orthonormal eigenvectors (n, k), of a symmetric matrix
    without negative ones."""
    n = matrix.shape[0]
    if n > DENSE:
        total = _count(_factors(matrix, limit))
        if total > MOST:
            raise InputError(
                f"harmonic basis: {total} waves as long as {2.0 * np.pi / np.sqrt(limit):.3g} m fit onto the "
                f"cloth, {MOST} at most are allowed; check the unit, which is metres, or ask for longer ones"
            )
        for attempt in range(ATTEMPTS):
            found = _by_slices(matrix, limit, total, -(-total // SLICE) + attempt)
            if found is not None:
                return found
    return eigh(matrix.toarray(), subset_by_value=(-np.inf, limit))


def _by_slices(
    matrix: csc_array, limit: float, total: int, slices: int
) -> tuple[np.ndarray, np.ndarray] | None:
    """The eigenpairs below the limit; None if those found are not as many as counted."""
    # Eigenvalues of a surface are spread evenly. Below 0 there is none, but the first slice may lie there.
    edges = np.linspace(0.0, limit, slices + 1)
    edges[0] = -0.5 * edges[1]
    counts = [0, *(_count(_factors(matrix, edge)) for edge in edges[1:-1]), total]
    if (np.diff(counts) < 0).any():
        return None
    parts = [
        _slice(matrix, 0.5 * (low + high), b - a)
        for low, high, a, b in zip(edges[:-1], edges[1:], counts[:-1], counts[1:], strict=True)
        if b > a
    ]
    values = np.concatenate([part[0] for part in parts])
    inside = np.searchsorted(np.sort(values), edges[1:])
    return (values, np.hstack([part[1] for part in parts])) if np.array_equal(inside, counts[1:]) else None


def _slice(matrix: csc_array, shift: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The `count` eigenpairs nearest to a shift, which are those of an interval around it."""
    n = matrix.shape[0]
    inverse = LinearOperator(matrix.shape, matvec=_factors(matrix, shift).solve, dtype=np.float64)
    start = np.random.default_rng(START).normal(size=n)
    values, vectors = eigsh(matrix, count, sigma=shift, OPinv=inverse, v0=start)
    order = np.argsort(values)
    return values[order], vectors[:, order]


def _factors(matrix: csc_array, shift: float) -> SuperLU:
    """L U = A - s I, symmetrically permuted."""
    shifted = csc_array(matrix - diags_array(np.full(matrix.shape[0], shift)))
    symmetric = {"SymmetricMode": True}
    return splu(shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric)


def _count(factors: SuperLU) -> int:
    """How many eigenvalues lie below the shift of `_factors`: the negative pivots."""
    return int((factors.U.diagonal() < 0.0).sum())
