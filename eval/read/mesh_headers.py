"""Headers of mesh files, read before the files are: a few bytes must not make a parser fill the memory."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

from muslin.garments.errors import InputError

PLY_HEADER_BYTES = 1 << 16
_GLB = struct.Struct("<4sII")
_CHUNK = struct.Struct("<I4s")


def check_header(path: Path) -> None:
    """Raise InputError for a wrong magic number, for counts that the file is too short for, and for what this
    project does not read (animated or compressed GLB)."""
    match path.suffix.lower():
        case ".ply":
            _check_ply(path)
        case ".off":
            _check_off(path)
        case ".glb":
            _check_glb(path)


def _check_ply(path: Path) -> None:
    with path.open("rb") as stream:
        head = stream.read(PLY_HEADER_BYTES)
    if not head.startswith(b"ply"):
        raise InputError(f"{path}: not a PLY file; it must begin with 'ply'")
    end = head.find(b"end_header")
    if end < 0:
        raise InputError(f"{path}: its PLY header has no end; give an intact file")
    for line in head[:end].decode("latin1").splitlines():
        words = line.split()
        if words[:1] == ["element"]:
            _check_count(path, f"element {words[1] if len(words) > 1 else ''}", words[-1])


def _check_off(path: Path) -> None:
    with path.open("rb") as stream:
        text = stream.read(PLY_HEADER_BYTES).decode("latin1")
    words = [word for line in text.splitlines() for word in line.partition("#")[0].split()]
    if not words or not words[0].endswith("OFF"):
        raise InputError(f"{path}: not an OFF file; it must begin with OFF")
    if len(words) < 4:
        raise InputError(f"{path}: its OFF header tells no counts of vertices, faces and edges")
    for what, word in zip(("vertices", "faces"), words[1:3], strict=True):
        _check_count(path, what, word)


def _check_glb(path: Path) -> None:
    size = path.stat().st_size
    with path.open("rb") as stream:
        head = stream.read(_GLB.size + _CHUNK.size)
        if len(head) < _GLB.size + _CHUNK.size or not head.startswith(b"glTF"):
            raise InputError(f"{path}: not a GLB file; it must begin with 'glTF'")
        _, version, length = _GLB.unpack_from(head)
        wanted, kind = _CHUNK.unpack_from(head, _GLB.size)
        if version != 2 or length != size or kind != b"JSON" or wanted > size:
            raise InputError(
                f"{path}: a GLB file of version {version}, {size} bytes where its header says {length}; "
                "give an intact file of version 2"
            )
        text = stream.read(wanted)
    try:
        tree = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: its JSON is damaged ({error}); give an intact file") from error
    if not isinstance(tree, dict):
        raise InputError(f"{path}: its JSON is no object; give an intact file")
    if tree.get("animations"):
        raise InputError(
            f"{path}: is animated, and animations of GLB are not read; export a folder of frames, USD, PC2 "
            "or npz instead"
        )
    if any("draco" in str(name) or "meshopt" in str(name) for name in _list(tree, "extensionsRequired")):
        raise InputError(f"{path}: its meshes are compressed; export it without compression")
    for accessor in _list(tree, "accessors"):
        _check_count(path, "accessor", accessor.get("count", 0) if isinstance(accessor, dict) else None)


def _list(tree: dict[str, Any], key: str) -> list[Any]:
    found = tree.get(key, [])
    return found if isinstance(found, list) else []


def _check_count(path: Path, what: str, said: Any) -> None:
    """Every element takes a byte at least, so a count above the size of the file is damage or worse."""
    try:
        count = int(said)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{path}: {what}: {said!r} is no count; give an intact file") from error
    size = path.stat().st_size
    if not 0 <= count <= size:
        raise InputError(f"{path}: {what}: a count of {count} in a file of {size} bytes; give an intact file")
