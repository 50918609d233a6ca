"""Surfaces that graph operators are tried on."""

import numpy as np
import trimesh


def sheet(rows: int = 9, columns: int = 12, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """A bent sheet with vertices at random places, so that no two collapses cost the same."""
    u, v = np.meshgrid(np.linspace(0.0, 1.0, columns), np.linspace(0.0, 0.7, rows))
    flat = np.stack([u.ravel(), v.ravel()], axis=1)
    inner = np.zeros((rows, columns), bool)
    inner[1:-1, 1:-1] = True
    flat[inner.ravel()] += np.random.default_rng(seed).uniform(-0.02, 0.02, (inner.sum(), 2))
    bent = 0.1 * np.sin(5.0 * flat[:, 0]) + 0.05 * np.cos(7.0 * flat[:, 1])
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    below = np.stack([corner, corner + 1, corner + columns + 1], axis=1)
    above = np.stack([corner, corner + columns + 1, corner + columns], axis=1)
    return np.column_stack([flat, bent]), np.concatenate([below, above]).astype(np.int32)


def renumbered(positions: np.ndarray, faces: np.ndarray, seed: int = 1):
    """(new positions, new faces, order): new vertex i is the old vertex order[i]; faces in another order."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(positions))
    number = np.argsort(order).astype(np.int32)
    turned = np.roll(number[faces], 1, axis=1)
    return positions[order], turned[rng.permutation(len(faces))], order


def sphere(subdivisions: int) -> tuple[np.ndarray, np.ndarray]:
    made = trimesh.creation.icosphere(subdivisions=subdivisions)
    return np.asarray(made.vertices), np.asarray(made.faces, dtype=np.int32)
