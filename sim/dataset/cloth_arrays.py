"""The cloth of a sample as the arrays that are stored, and back: one mesh, or several."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.dataset.remeshed import RemeshedSequence
from muslin.sim.dataset.sample import Sample
from muslin.sim.dataset.schema import GARMENT_ARRAYS

VERTICES, FACES, PANEL_VERTICES = range(3)
"""Columns of `topology_sizes`."""


def cloth_arrays(sample: Sample) -> dict[str, np.ndarray]:
    """Arrays of garment and positions; where the topology changes, those of all topologies and of all frames
    stacked, with `topology_sizes` and `frame_topology` to tell them apart."""
    if not isinstance(sample, RemeshedSequence):
        return {name: getattr(sample.garment, name) for name in GARMENT_ARRAYS} | {
            "positions": sample.positions
        }
    meshes = sample.topologies
    sizes = [(mesh.num_vertices, len(mesh.faces), len(mesh.panel_vertices)) for mesh in meshes]
    return {
        **{name: np.concatenate([getattr(mesh, name) for mesh in meshes]) for name in GARMENT_ARRAYS},
        "positions": np.concatenate(sample.frames),
        "frame_topology": sample.frame_topology,
        "topology_sizes": np.array(sizes),
    }


def cloth_of(garment: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """The fields of a `Sample`, or of a `RemeshedSequence`, that `cloth_arrays` was made from.

    garment: name, panel_names and parameters. Raises InputError where sizes and arrays do not fit each other,
    KeyError for an array that is missing.
    """
    if "frame_topology" not in arrays:
        mesh = _mesh(garment, {name: arrays[name] for name in GARMENT_ARRAYS})
        return {"garment": mesh, "positions": arrays["positions"]}
    sizes, frame_topology = arrays["topology_sizes"], arrays["frame_topology"]
    if sizes.ndim != 2 or sizes.shape[1] != 3:
        raise InputError(f"topology_sizes has shape {sizes.shape}; it must be (topologies, 3)")
    if frame_topology.size and not 0 <= frame_topology.min() <= frame_topology.max() < len(sizes):
        raise InputError(f"frame_topology must be from 0 to {len(sizes) - 1}")
    column = {"face": FACES, "panel_vertex": PANEL_VERTICES}
    pieces = {
        name: _cut(name, arrays[name], sizes[:, column[spec.dimensions[0]]])
        for name, spec in GARMENT_ARRAYS.items()
    }
    return {
        "topologies": tuple(
            _mesh(garment, {name: pieces[name][k] for name in GARMENT_ARRAYS}) for k in range(len(sizes))
        ),
        "frame_topology": frame_topology,
        "frames": _cut("positions", arrays["positions"], sizes[frame_topology, VERTICES]),
    }


def _mesh(garment: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> GarmentMesh:
    return GarmentMesh(
        **arrays,
        panel_names=tuple(garment["panel_names"]),
        name=garment["name"],
        parameters=garment["parameters"],
    )


def _cut(name: str, array: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, ...]:
    """Pieces of `counts` rows each, all of the array."""
    if (counts < 0).any() or counts.sum() != len(array):
        raise InputError(
            f"{name} has {len(array)} rows; topology_sizes and frame_topology ask for {counts.sum()}"
        )
    return tuple(np.split(array, np.cumsum(counts)[:-1]))
