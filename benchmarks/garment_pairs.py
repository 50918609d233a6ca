"""Pairs of garments to measure distances of: put on, wrinkled by waves, remeshed."""

from __future__ import annotations

from pathlib import Path

import igl
import numpy as np
from numpy.typing import NDArray

from benchmarks.surfaces.exchange import Pair
from muslin.eval.remesh_source import remesh_source
from muslin.garments.designs.tee import TEE
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.sim.body.load import load_body
from muslin.sim.dress import place
from muslin.sim.remesh.topology import remesh

BODY = "neutral"
WAVES = 12
WAVELENGTHS = (0.04, 0.2)  # metres
HEIGHT = 0.006  # root mean square, metres


def wrinkled_pairs(preset: str, vertices: int) -> dict[str, Pair]:
    """A garment of about so many vertices with wrinkles, against itself on other triangles ("near"), and
    against the garment with other wrinkles on other triangles ("far")."""
    mesh = template("tee", TEE.preset(preset), vertices)
    body = load_body(BODY)
    beta = np.zeros(body.num_betas)
    smooth = place(mesh, body, beta, body.vertices(beta))
    here = _wrinkle(smooth, mesh.faces, 1)
    return {
        f"{preset} near": _against_remeshed(mesh, here, here, vertices, 1),
        f"{preset} far": _against_remeshed(mesh, here, _wrinkle(smooth, mesh.faces, 2), vertices, 2),
    }


def drape_pair(path: Path) -> Pair:
    """A simulated drape against itself on as many other triangles."""
    source = remesh_source(path)
    if source.positions is None:
        raise ValueError(f"{path}: a flat file has no drape")
    return _against_remeshed(source.mesh, source.positions, source.positions, source.mesh.num_vertices, 1)


def _against_remeshed(
    mesh: GarmentMesh, here: NDArray[np.float64], there: NDArray[np.float64], vertices: int, seed: int
) -> Pair:
    made = remesh(mesh, there, float(mesh.face_areas.sum()) / (2.0 * vertices), seed=seed)
    return Pair(here, mesh.faces, made.positions, made.mesh.faces)


def _wrinkle(x: NDArray[np.float64], faces: NDArray[np.int32], seed: int) -> NDArray[np.float64]:
    """Moved along vertex normals by a sum of random waves."""
    rng = np.random.default_rng(seed)
    normals = np.nan_to_num(igl.per_vertex_normals(x, faces.astype(np.int64)))
    height = np.zeros(len(x))
    for _ in range(WAVES):
        direction = rng.normal(size=3)
        wave = 2.0 * np.pi / rng.uniform(*WAVELENGTHS) * direction / np.linalg.norm(direction)
        height += rng.normal() * np.sin(x @ wave + rng.uniform(0.0, 2.0 * np.pi))
    return x + HEIGHT * np.sqrt(2.0 / WAVES) * height[:, None] * normals
