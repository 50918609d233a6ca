"""PyMeshLab's `get_hausdorff_distance`, run the right way: both ways, from points spread over faces by area,
and no distance cut off (`maxdist` 100% of the diagonal). Its vertices, a second call, help the largest
distance and would bias the mean."""

from __future__ import annotations

import pymeshlab

from benchmarks.surfaces.exchange import Pair, contend


def measure(pair: Pair) -> dict[str, float]:
    """Mean and largest distance, metres, of `samples` points a side."""
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(pair.vertices_a, pair.faces_a))
    meshes.add_mesh(pymeshlab.Mesh(pair.vertices_b, pair.faces_b))
    far = pymeshlab.PercentageValue(100.0)
    means, largest, taken = [], [], []
    for source, target in ((0, 1), (1, 0)):
        sides = {"sampledmesh": source, "targetmesh": target, "maxdist": far}
        faces = meshes.get_hausdorff_distance(
            **sides, samplevert=False, sampleedge=False, sampleface=True, samplenum=pair.samples
        )
        vertices = meshes.get_hausdorff_distance(**sides, samplevert=True, sampleedge=False, sampleface=False)
        means.append(faces["mean"])
        largest.append(max(faces["max"], vertices["max"]))
        taken.append(faces["n_samples"])
    return {"mean": 0.5 * sum(means), "lower": max(largest), "samples": min(taken)}


if __name__ == "__main__":
    contend(measure, ("pymeshlab", "numpy"))
