"""Universal Scene Description: one file a sample, one mesh a part, points sampled over time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from muslin.garments.errors import InputError
from muslin.sim.dataset.parts import MovingPart, Part, RemeshedPart


def write_usd(path: Path, parts: Sequence[MovingPart], fps: float | None) -> None:
    """Write parts under /sample, y up, metres; frame t at time code t. Raises InputError without usd-core.

    Faces and uv of a part whose topology changes are samples over time too, at the first and the last frame
    of each topology: between samples USD interpolates, and between two that are equal nothing changes.
    """
    try:
        from pxr import Tf, Usd, UsdGeom
    except ImportError as error:
        raise InputError("format usd needs the package usd-core; pip install 'muslin[usd]'") from error
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    frames = max(part.num_frames for part in parts)
    stage.SetTimeCodesPerSecond(fps or 24.0)
    stage.SetFramesPerSecond(fps or 24.0)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(frames - 1)
    root = UsdGeom.Xform.Define(stage, "/sample")
    stage.SetDefaultPrim(root.GetPrim())
    for part in parts:
        mesh = UsdGeom.Mesh.Define(stage, f"/sample/{Tf.MakeValidIdentifier(part.name)}")
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        still = Usd.TimeCode.Default()
        if isinstance(part, RemeshedPart):
            first = np.diff(part.frame_topology, prepend=-1) != 0
            last = np.diff(part.frame_topology, append=-1) != 0
            for frame in np.flatnonzero(first | last).tolist():
                _set_topology(mesh, part.at(frame), Usd.TimeCode(frame))
        else:
            _set_topology(mesh, part, still)
        for frame in range(part.num_frames):
            _set_points(mesh, part.at(frame), Usd.TimeCode(frame) if part.num_frames > 1 else still)
    stage.GetRootLayer().Save()


def _set_topology(mesh: Any, part: Part, time: Any) -> None:
    from pxr import Sdf, UsdGeom, Vt

    corners = np.full(len(part.faces), 3, dtype=np.int32)
    mesh.CreateFaceVertexCountsAttr().Set(Vt.IntArray.FromNumpy(corners), time)
    mesh.CreateFaceVertexIndicesAttr().Set(Vt.IntArray.FromNumpy(part.faces.ravel().astype(np.int32)), time)
    if part.uv is not None and part.uv_faces is not None:
        api = UsdGeom.PrimvarsAPI(mesh)
        st = api.CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying)
        st.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(part.uv, dtype=np.float32)), time)
        st.SetIndices(Vt.IntArray.FromNumpy(part.uv_faces.ravel().astype(np.int32)), time)


def _set_points(mesh: Any, part: Part, time: Any) -> None:
    from pxr import Gf, Vt

    positions = np.ascontiguousarray(part.positions[0], dtype=np.float32)
    mesh.CreatePointsAttr().Set(Vt.Vec3fArray.FromNumpy(positions), time)
    low, high = positions.min(axis=0), positions.max(axis=0)
    mesh.CreateExtentAttr().Set(Vt.Vec3fArray([Gf.Vec3f(*low.tolist()), Gf.Vec3f(*high.tolist())]), time)
