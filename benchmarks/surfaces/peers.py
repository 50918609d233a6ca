"""What libigl, trimesh, point-cloud-utils, scipy and PyMeshLab say of a pair: by their defaults, and run the
right way. In the names, "points" are distances of fixed points to the second mesh, the rest distances of the
pair."""

from __future__ import annotations

import igl
import numpy as np
import point_cloud_utils as pcu
import pymeshlab
import trimesh
from numpy.typing import NDArray
from scipy.spatial.distance import directed_hausdorff

from benchmarks.surfaces.exchange import Pair, contend, fixed_points

SAMPLES = 200_000
PACKAGES = ("libigl", "trimesh", "point-cloud-utils", "scipy", "pymeshlab", "numpy")


def measure(pair: Pair) -> dict[str, float]:
    """Figures in metres, by the peer and the way it is run."""
    return {**_points(pair), **_hausdorff(pair), **_meshlab(pair)}


def _points(pair: Pair) -> dict[str, float]:
    """Largest and mean distance of the fixed points."""
    points, v, f = fixed_points(pair), pair.vertices_b, pair.faces_b
    found: dict[str, NDArray[np.float64]] = {
        "libigl": np.sqrt(igl.point_mesh_squared_distance(points, v, f.astype(np.int64))[0]),
        "trimesh": trimesh.proximity.closest_point(trimesh.Trimesh(v, f, process=False), points)[1],
        "point-cloud-utils": pcu.closest_points_on_mesh(points, v, f)[0].astype(np.float64),
    }
    sums = {f"{name}: points, mean": float(d.mean()) for name, d in found.items()}
    return sums | {f"{name}: points, largest": float(d.max()) for name, d in found.items()}


def _hausdorff(pair: Pair) -> dict[str, float]:
    a, b = pair.vertices_a, pair.vertices_b
    fa, fb = pair.faces_a.astype(np.int64), pair.faces_b.astype(np.int64)
    return {
        "libigl: hausdorff": float(igl.hausdorff(a, fa, b, fb)),
        "point-cloud-utils: hausdorff_distance": float(pcu.hausdorff_distance(a, b)),
        "point-cloud-utils: chamfer_distance": float(pcu.chamfer_distance(a, b)),
        "scipy: directed_hausdorff, both ways": float(
            max(directed_hausdorff(a, b)[0], directed_hausdorff(b, a)[0])
        ),
    }


def _meshlab(pair: Pair) -> dict[str, float]:
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(pair.vertices_a, pair.faces_a))
    meshes.add_mesh(pymeshlab.Mesh(pair.vertices_b, pair.faces_b))
    default = meshes.get_hausdorff_distance(sampledmesh=0, targetmesh=1)
    means, largest = {}, {}
    ways = {"faces": {"samplevert": False}, "all": {"samplevert": True, "sampleedge": True}}
    for way, options in ways.items():
        both = [
            meshes.get_hausdorff_distance(
                sampledmesh=source,
                targetmesh=target,
                maxdist=pymeshlab.PercentageValue(100.0),
                sampleface=True,
                samplenum=SAMPLES,
                **options,
            )
            for source, target in ((0, 1), (1, 0))
        ]
        means[way] = 0.5 * sum(one["mean"] for one in both)
        largest[way] = max(one["max"] for one in both)
    return {
        "PyMeshLab: defaults, largest": default["max"],
        "PyMeshLab: defaults, mean": default["mean"],
        "PyMeshLab: face samples, largest": largest["faces"],
        "PyMeshLab: face samples, mean": means["faces"],
        "PyMeshLab: vertex, edge and face samples, largest": largest["all"],
        "PyMeshLab: vertex, edge and face samples, mean": means["all"],
    }


if __name__ == "__main__":
    contend(measure, PACKAGES)
