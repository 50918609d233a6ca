"""Samples and meshes in the formats that other programs read."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
import trimesh
from trimesh.visual import TextureVisuals

from muslin.garments.errors import InputError
from muslin.sim.dataset import durable
from muslin.sim.dataset.parts import MovingPart, Part, RemeshedPart, sample_parts
from muslin.sim.dataset.pc2 import write_pc2
from muslin.sim.dataset.reader import Dataset
from muslin.sim.dataset.root import Root
from muslin.sim.dataset.selection import select
from muslin.sim.dataset.usd import write_usd

Writer = Callable[[Path], None]

FORMATS = ("obj", "ply", "glb", "usd", "pc2", "npz")


def export_dataset(
    path: Dataset | str | Path | Root,
    out: str | Path,
    file_format: str,
    *,
    ids: Iterable[str] | None = None,
    body: bool = True,
    progress: Callable[[float, int, str], None] | None = None,
) -> list[Path]:
    """Write every sample (or those of `ids`) of a dataset, body included; return the files.

    Raises InputError for an unknown format or id, and if a file would be overwritten.
    """
    chosen = select(path, ids=ids)
    written: list[Path] = []
    for done, sample in enumerate(chosen, start=1):
        written += export_parts(sample.id, sample_parts(sample, body), sample.fps, out, file_format)
        if progress is not None:
            progress(done, len(chosen), sample.id)
    return written


def export_parts(
    name: str, parts: Sequence[MovingPart], fps: float | None, out: str | Path, file_format: str
) -> list[Path]:
    """Write parts that move together; of a part whose topology changes every frame has its own.

    obj, ply   NAME_PART.obj, or NAME/PART_0000.obj … of a sequence; OBJ carries uv
    glb        NAME.glb, or NAME/0000.glb …, all parts in one file
    usd        NAME.usd, positions over time
    pc2        NAME_PART.pc2 with the first frame as NAME_PART.obj; fixed topology only
    npz        NAME.npz: PART_positions, PART_faces, PART_uv, PART_uv_faces, fps; where the topology changes,
               PART_positions_0000 … a frame, PART_topology (T,) and PART_faces_0 … a topology, so with uv

    Raises InputError for a format that cannot hold what is asked for, and if a file would be overwritten.
    """
    if file_format not in FORMATS:
        raise InputError(f"format {file_format!r}: must be one of {', '.join(FORMATS)}")
    folder = Path(out)
    files = {folder / relative: writer for relative, writer in _files(name, parts, fps, file_format).items()}
    for file in files:
        if file.exists():
            raise InputError(f"{file}: exists; remove it, or export to another folder")
    for file, writer in files.items():
        durable.make_folder(file.parent)
        partial = file.with_name(f"partial-{os.getpid()}-{file.name}")
        try:
            writer(partial)
            os.replace(partial, file)
        finally:
            partial.unlink(missing_ok=True)
    return list(files)


def write_obj(path: Path, part: Part) -> None:
    """Write the first frame as OBJ: sewn vertices, faces with uv corners. Nine digits keep float32."""
    lines = [f"o {part.name}"]
    lines += ["v {:.9g} {:.9g} {:.9g}".format(*xyz) for xyz in part.positions[0].tolist()]
    if part.uv is not None and part.uv_faces is not None:
        lines += ["vt {:.9g} {:.9g}".format(*uv) for uv in part.uv.tolist()]
        corners = np.stack([part.faces, part.uv_faces], axis=2) + 1
        lines += ["f {}/{} {}/{} {}/{}".format(*face) for face in corners.reshape(-1, 6).tolist()]
    else:
        lines += ["f {} {} {}".format(*face) for face in (part.faces + 1).tolist()]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def _files(name: str, parts: Sequence[MovingPart], fps: float | None, file_format: str) -> dict[str, Writer]:
    frames = max(part.num_frames for part in parts)
    match file_format:
        case "usd":
            return {f"{name}.usd": lambda path: write_usd(path, parts, fps)}
        case "npz":
            return {f"{name}.npz": lambda path: _write_npz(path, parts, fps)}
        case "glb":
            names = [f"{name}.glb"] if frames == 1 else [f"{name}/{k:04d}.glb" for k in range(frames)]
            return {file: _glb_writer(parts, k) for k, file in enumerate(names)}
        case "pc2":
            caches = {f"{name}_{part.name}.pc2": _pc2_writer(name, part) for part in parts}
            return caches | {f"{name}_{part.name}.obj": _mesh_writer(part, 0, "obj") for part in parts}
    files: dict[str, Writer] = {}
    for part in parts:
        for k in range(part.num_frames):
            still = f"{name}_{part.name}.{file_format}"
            file = still if frames == 1 else f"{name}/{part.name}_{k:04d}.{file_format}"
            files[file] = _mesh_writer(part, k, file_format)
    return files


def _pc2_writer(name: str, part: MovingPart) -> Writer:
    if isinstance(part, RemeshedPart):
        raise InputError(
            f"format pc2: the topology of {name}'s {part.name} changes over time, and a point cache has "
            "but one; export it as usd, or frame by frame as obj, ply or glb"
        )
    positions = part.positions
    return lambda path: write_pc2(path, positions)


def _mesh_writer(part: MovingPart, frame: int, file_format: str) -> Writer:
    if file_format == "obj":
        return lambda path: write_obj(path, part.at(frame))

    def write_ply(path: Path) -> None:
        now = part.at(frame)
        mesh = trimesh.Trimesh(now.positions[0], now.faces, process=False)
        mesh.export(path, file_type="ply", vertex_normal=False)

    return write_ply


def _glb_writer(parts: Sequence[MovingPart], frame: int) -> Writer:
    def write(path: Path) -> None:
        scene = trimesh.Scene()
        for part in parts:
            scene.add_geometry(_textured(part.at(frame)), node_name=part.name, geom_name=part.name)
        path.write_bytes(scene.export(file_type="glb"))

    return write


def _textured(part: Part) -> trimesh.Trimesh:
    positions = part.positions[0]
    sewn = trimesh.Trimesh(positions, part.faces, process=False)
    if part.uv is None or part.uv_faces is None:
        return sewn
    # A vertex of glTF has one uv, so seams are cut; normals of the sewn mesh keep the shading whole.
    vertex = part.uv_to_vertex
    return trimesh.Trimesh(
        positions[vertex],
        part.uv_faces,
        vertex_normals=sewn.vertex_normals[vertex],
        visual=TextureVisuals(uv=part.uv),
        process=False,
    )


def _write_npz(path: Path, parts: Sequence[MovingPart], fps: float | None) -> None:
    arrays: dict[str, np.ndarray] = {"fps": np.array(fps or 0.0)}
    for part in parts:
        if isinstance(part, Part):
            arrays |= {f"{part.name}_positions": part.positions, **_topology_arrays(part)}
            continue
        arrays[f"{part.name}_topology"] = part.frame_topology
        arrays |= {f"{part.name}_positions_{k:04d}": frame for k, frame in enumerate(part.frames)}
        for k, topology in enumerate(part.topologies):
            arrays |= {f"{key}_{k}": array for key, array in _topology_arrays(topology).items()}
    with path.open("wb") as stream:
        np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]


def _topology_arrays(part: Part) -> dict[str, np.ndarray]:
    arrays = {f"{part.name}_faces": part.faces}
    if part.uv is not None and part.uv_faces is not None:
        arrays |= {f"{part.name}_uv": part.uv, f"{part.name}_uv_faces": part.uv_faces}
    return arrays
