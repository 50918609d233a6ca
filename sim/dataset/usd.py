"""Universal Scene Description: one file a sample, one mesh a part, points sampled over time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from muslin.garments.errors import InputError
from muslin.sim.dataset.parts import Part


def write_usd(path: Path, parts: Sequence[Part], fps: float | None) -> None:
    """Write parts under /sample, y up, metres; frame t at time code t. Raises InputError without usd-core."""
    try:
        from pxr import Gf, Sdf, Tf, Usd, UsdGeom, Vt
    except ImportError as error:
        raise InputError("format usd needs the package usd-core; pip install 'muslin[usd]'") from error
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    frames = max(len(part.positions) for part in parts)
    stage.SetTimeCodesPerSecond(fps or 24.0)
    stage.SetFramesPerSecond(fps or 24.0)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(frames - 1)
    root = UsdGeom.Xform.Define(stage, "/sample")
    stage.SetDefaultPrim(root.GetPrim())
    for part in parts:
        mesh = UsdGeom.Mesh.Define(stage, f"/sample/{Tf.MakeValidIdentifier(part.name)}")
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(part.faces), 3, dtype=np.int32)))
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(part.faces.ravel().astype(np.int32)))
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        points, extent = mesh.CreatePointsAttr(), mesh.CreateExtentAttr()
        for frame, positions in enumerate(np.ascontiguousarray(part.positions, dtype=np.float32)):
            time = Usd.TimeCode(frame) if len(part.positions) > 1 else Usd.TimeCode.Default()
            points.Set(Vt.Vec3fArray.FromNumpy(positions), time)
            low, high = positions.min(axis=0), positions.max(axis=0)
            extent.Set(Vt.Vec3fArray([Gf.Vec3f(*low.tolist()), Gf.Vec3f(*high.tolist())]), time)
        if part.uv is not None and part.uv_faces is not None:
            api = UsdGeom.PrimvarsAPI(mesh)
            st = api.CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying)
            st.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(part.uv, dtype=np.float32)))
            st.SetIndices(Vt.IntArray.FromNumpy(part.uv_faces.ravel().astype(np.int32)))
    stage.GetRootLayer().Save()
