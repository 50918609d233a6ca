"""Universal Scene Description: a mesh whose points are sampled over time, and its body."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from muslin.eval.read.content import Content, Up, cloth_and_body
from muslin.eval.read.polygons import fans
from muslin.garments.errors import InputError

MAGIC = {".usda": b"#usda", ".usdc": b"PXR-USDC", ".usdz": b"PK"}


def read_usd(path: Path) -> Content:
    """The garment of a stage, with its transforms, in the stage's units; one frame a time sample.

    Where samples are spaced unevenly, by whole steps, USD's interpolation fills the frames between. The rate,
    the unit and the up axis count only if the stage says them: USD's fallbacks (24, centimetres, y) are what
    a writer that forgot them has as well.

    Raises InputError without usd-core, for a damaged file, and if it is not clear which mesh is the garment.
    """
    try:
        from pxr import Usd, UsdGeom
    except ImportError as error:
        raise InputError(
            f"{path}: reading USD needs the package usd-core; pip install 'muslin[usd]'"
        ) from error
    _check_magic(path)
    with _reading(path):
        stage = Usd.Stage.Open(str(path))
        meshes = {
            str(prim.GetPath()): UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)
        }
    cloth, body = cloth_and_body(meshes, path, "mesh")
    times, step, notes = _times(meshes[cloth].GetPointsAttr().GetTimeSamples(), path)
    content = _content(stage, meshes[cloth], times, path)
    rate = stage.GetTimeCodesPerSecond() if stage.HasAuthoredMetadata("timeCodesPerSecond") else None
    up: Up | None = None
    if stage.HasAuthoredMetadata(UsdGeom.Tokens.upAxis):
        up = "z" if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else "y"
    return replace(
        content,
        body=None if body is None else _content(stage, meshes[body], times, path),
        fps=rate / step if rate and len(times) > 1 else None,
        metres=UsdGeom.GetStageMetersPerUnit(stage) if UsdGeom.StageHasAuthoredMetersPerUnit(stage) else None,
        up=up,
        notes=notes,
    )


def _times(samples: list[float], path: Path) -> tuple[list[float | None], float, tuple[str, ...]]:
    """Times of the frames, None for the one frame of a mesh that is not animated; their step; remarks."""
    if len(samples) < 2:
        return [samples[0] if samples else None], 1.0, ()
    gaps = np.diff(samples)
    step = float(gaps.min())
    counts = gaps / step
    if np.abs(counts - counts.round()).max() > 1e-3 or counts.sum() > 100 * len(samples):
        raise InputError(
            f"{path}: the time samples of the mesh are spaced unevenly, {step:g} to {gaps.max():g} time "
            "codes; export with one sample a frame"
        )
    total = int(counts.round().sum()) + 1
    notes: tuple[str, ...] = ()
    if total > len(samples):
        notes = (
            f"{path.name}: {total - len(samples)} of {total} frames have no sample and are interpolated",
        )
    return [samples[0] + step * k for k in range(total)], step, notes


def _content(stage: Any, mesh: Any, times: list[float | None], path: Path) -> Content:
    from pxr import Usd, UsdGeom

    codes = [Usd.TimeCode.Default() if time is None else Usd.TimeCode(time) for time in times]
    where = f"{path}, {mesh.GetPath()}"
    with _reading(path):
        flip = mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded
    faces: list[np.ndarray] = []
    before: tuple[Any, Any] | None = None
    for code in codes:
        with _reading(path):
            now = mesh.GetFaceVertexCountsAttr().Get(code), mesh.GetFaceVertexIndicesAttr().Get(code)
        if now[0] is None or now[1] is None:
            raise InputError(f"{where}: has no faces; export it as a mesh")
        if before is None or now != before:
            faces.append(fans(np.array(now[0]), np.array(now[1]), where, flip))
        else:
            faces.append(faces[-1])
        before = now

    return Content(len(codes), partial(_points, stage, mesh, codes, path), faces)


def _points(stage: Any, mesh: Any, codes: list[Any], path: Path, frame: int) -> np.ndarray:
    """(V, 3) in the world. The stage is passed along because a mesh dies with it."""
    with _reading(path):
        points = mesh.GetPointsAttr().Get(codes[frame])
        to_world = np.array(mesh.ComputeLocalToWorldTransform(codes[frame]))
    if points is None or not len(points):
        raise InputError(f"{path}, {mesh.GetPath()}: has no points in frame {frame}; export it again")
    x = np.array(points, dtype=np.float64)
    # USD's matrices multiply row vectors
    return x if np.array_equal(to_world, np.eye(4)) else x @ to_world[:3, :3] + to_world[3, :3]


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Turn USD's errors, which come at any access to a damaged file, into an InputError."""
    from pxr import Tf

    try:
        yield
    except (Tf.ErrorException, RuntimeError, UnicodeDecodeError) as error:
        raise InputError(
            f"{path}: not readable as a USD file ({_said(error)}); give an intact file"
        ) from error


def _said(error: Exception) -> str:
    try:
        return " ".join(str(error).split())[:160]
    except UnicodeDecodeError:
        # USD quotes what it could not parse
        return "it holds bytes that are no text"


def _check_magic(path: Path) -> None:
    with path.open("rb") as stream:
        head = stream.read(8)
    known = MAGIC.get(path.suffix.lower())
    allowed = (known,) if known else tuple(MAGIC.values())
    if not any(head.startswith(magic) for magic in allowed):
        raise InputError(f"{path}: not a USD file; it must begin with {' or '.join(map(repr, allowed))}")
