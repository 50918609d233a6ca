"""The process that reads an Alembic archive: `python -m muslin.eval.read.alembic_child IN.abc OUT.npz`."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from muslin.eval.read.content import cloth_and_body
from muslin.eval.read.polygons import fans
from muslin.garments.errors import InputError


def main(source: Path, out: Path) -> None:
    """Write the garment's and the body's positions and faces, in the world, and the rate of the samples."""
    from alembic3d import Abc

    archive = Abc.IArchive(str(source))
    meshes = dict(_meshes(archive.getTop(), "", []))
    cloth, body = cloth_and_body(meshes, source, "mesh")
    mesh, _ = meshes[cloth]
    sampling = mesh.getSchema().getTimeSampling()
    times = [sampling.getSampleTime(k) for k in range(mesh.getSchema().getNumSamples())]
    arrays = _arrays("cloth", *meshes[cloth], times)
    if body is not None:
        moving = _arrays("body", *meshes[body], times)
        if "body_positions" in moving:
            arrays |= moving
    arrays["fps"] = np.array(_rate(times, source))
    with out.open("wb") as stream:
        np.savez(stream, **arrays)  # type: ignore[arg-type]


def _meshes(parent: Any, path: str, transforms: list[Any]) -> Iterator[tuple[str, tuple[Any, list[Any]]]]:
    from alembic3d import AbcGeom

    for k in range(parent.getNumChildren()):
        child = parent.getChild(k)
        name, header = child.getName(), child.getHeader()
        if AbcGeom.IPolyMesh.matches(header):
            yield f"{path}/{name}", (AbcGeom.IPolyMesh(parent, name), transforms)
        above = [AbcGeom.IXform(parent, name)] if AbcGeom.IXform.matches(header) else []
        yield from _meshes(child, f"{path}/{name}", transforms + above)


def _arrays(part: str, mesh: Any, transforms: list[Any], times: list[float]) -> dict[str, np.ndarray]:
    from alembic3d import Abc

    frames: list[np.ndarray] = []
    faces: list[np.ndarray] = []
    order: list[int] = []
    for time in times:
        at = Abc.ISampleSelector(float(time))
        sample = mesh.getSchema().getValue(at)
        to_world = _to_world(transforms, at)
        frames.append(np.array(sample.getPositions()).reshape(-1, 3) @ to_world[:3, :3] + to_world[3, :3])
        # Alembic lists corners clockwise
        now = fans(np.array(sample.getFaceCounts()), np.array(sample.getFaceIndices()), part, flip=True)
        if not faces or not np.array_equal(now, faces[-1]):
            faces.append(now)
        order.append(len(faces) - 1)
    if len(faces) == 1:
        return {f"{part}_positions": np.stack(frames).astype(np.float32), f"{part}_faces": faces[0]}
    changing = {f"{part}_positions_{t:04d}": x.astype(np.float32) for t, x in enumerate(frames)}
    topologies = {f"{part}_faces_{k}": triangles for k, triangles in enumerate(faces)}
    return {f"{part}_topology": np.array(order), **changing, **topologies}


def _to_world(transforms: list[Any], at: Any) -> np.ndarray:
    """(4, 4) product of the transforms above a mesh, for row vectors; the innermost is applied first."""
    total = np.eye(4)
    for transform in reversed(transforms):
        matrix = transform.getSchema().getValue(at).getMatrix()
        total = total @ np.array([[matrix[i][j] for j in range(4)] for i in range(4)])
    return total


def _rate(times: list[float], source: Path) -> float:
    """Frames per second; 0 for one frame."""
    if len(times) < 2:
        return 0.0
    steps = np.diff(times)
    if steps.min() <= 0 or np.ptp(steps) > 1e-3 * steps.mean():
        raise InputError(f"{source.name}: its samples are spaced unevenly in time; export one a frame")
    return round(1.0 / float(steps.mean()), 6)


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1]), Path(sys.argv[2]))
    except Exception as error:  # the parent tells what was wrong, in one line
        print(" ".join(str(error).split()) or type(error).__name__, file=sys.stderr)
        sys.exit(1)
