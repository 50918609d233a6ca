"""Point caches: PC2 of Blender and 3ds Max, and PC16, CLOTH3D's version of it in half precision.

Little endian: 12 bytes "POINTCACHE2\\0", int32 version 1, int32 points, float32 start frame, float32 sample
rate, int32 samples; then samples x points x 3 numbers, float32 in PC2 and float16 in PC16. The sample rate
counts samples a frame of some scene, so a cache does not say how many frames a second has.

CLOTH3D's positions are relative to the root joint of its body, z up; the root's path and a turn about z are
in the info.mat beside them. Positions are taken as stored here: distances between two such files are those
between the absolute positions, since both are moved and turned alike.

Source: Bertiche, Madadi, Escalera (2020), "CLOTH3D: Clothed 3D Humans"; Autodesk's description of PC2.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from muslin.eval.read.content import Content, is_body
from muslin.eval.read.meshes import MESH_SUFFIXES, read_mesh
from muslin.garments.errors import InputError

_HEADER = struct.Struct("<12siiffi")
_MAGIC = b"POINTCACHE2\0"
_TYPES: dict[str, np.dtype] = {".pc2": np.dtype("<f4"), ".pc16": np.dtype("<f2")}
RELATIVE = (
    "PC16 is read as CLOTH3D stores it, relative to the body's root: both sides, and a body, have to be so"
)


def read_pointcache(path: Path) -> Content:
    """Positions, mapped into memory, with the faces of the mesh beside the cache, if there is one.

    That is the mesh file of the same stem, or the only one in the folder that is not named as a body.
    """
    frames = map_pointcache(path)
    mesh = mesh_beside(path)
    faces = []
    if mesh is not None:
        surface = read_mesh(mesh)
        if len(surface.vertices) != frames.shape[1]:
            raise InputError(
                f"{path}: has {frames.shape[1]} points, but {mesh.name} beside it has "
                f"{len(surface.vertices)} vertices; put its own mesh there, with the same stem"
            )
        faces = [surface.faces] * len(frames)
    notes = (RELATIVE,) if path.suffix.lower() == ".pc16" else ()
    return Content(len(frames), lambda t: frames[t], faces, notes=notes)


def map_pointcache(path: Path) -> np.ndarray:
    """(T, V, 3) positions, mapped into memory, float32 or float16. Raises InputError for a damaged file."""
    size = path.stat().st_size
    with path.open("rb") as stream:
        head = stream.read(_HEADER.size)
    if len(head) < _HEADER.size or not head.startswith(_MAGIC):
        raise InputError(f"{path}: not a point cache; it must begin with POINTCACHE2")
    _, version, points, _, _, samples = _HEADER.unpack(head)
    if version != 1:
        swapped = struct.unpack(">i", struct.pack("<i", version))[0] == 1
        said = "it is big endian, a cache is little endian" if swapped else "1 is read"
        raise InputError(f"{path}: a point cache of version {version}; {said}")
    if points <= 0 or samples <= 0:
        raise InputError(f"{path}: a point cache of {points} points and {samples} samples; it holds nothing")
    dtype = _TYPES[path.suffix.lower()]
    wanted = _HEADER.size + 3 * points * samples * dtype.itemsize
    if size != wanted:
        other = next(name for name in _TYPES if name != path.suffix.lower())
        fits = size == _HEADER.size + 3 * points * samples * _TYPES[other].itemsize
        remedy = f"it fits {other}, rename it" if fits else "write the file again"
        raise InputError(f"{path}: {size} bytes, its header asks for {wanted}; {remedy}")
    return np.memmap(path, dtype=dtype, mode="r", offset=_HEADER.size, shape=(samples, points, 3))


def mesh_beside(path: Path) -> Path | None:
    """The mesh that goes with a cache: of the same stem, else the only one of the folder; None without."""
    meshes = sorted(file for file in path.parent.iterdir() if file.suffix.lower() in MESH_SUFFIXES)
    same = [file for file in meshes if file.stem == path.stem]
    others = [file for file in meshes if is_body(file.stem) == is_body(path.stem)]
    found = same or others
    return found[0] if len(found) == 1 or same else None
