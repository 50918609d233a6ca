"""Point Cache 2 files, read by Blender, Maya and 3ds Max; and PC16, CLOTH3D's form of them in half precision.

Little endian: 12 bytes "POINTCACHE2\\0", int32 version 1, int32 points, float32 start frame, float32 sample
rate (frames of the cache a frame of the scene), int32 samples; then samples x points x 3 float32, or in PC16
float16.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from muslin.garments.errors import InputError

_HEADER = struct.Struct("<12siiffi")
_MAGIC = b"POINTCACHE2\0"


def write_pc2(path: Path, positions: np.ndarray, dtype: str = "<f4") -> None:
    """Write positions (T, V, 3) as one cache, one sample a frame; as PC16 with dtype "<f2"."""
    samples, points, _ = positions.shape
    with path.open("wb") as stream:
        stream.write(_HEADER.pack(_MAGIC, 1, points, 0.0, 1.0, samples))
        stream.write(np.ascontiguousarray(positions, dtype=dtype).tobytes())


def read_pc2(path: str | Path) -> np.ndarray:
    """(T, V, 3) float32 positions of a cache. Raises InputError if the file is none or is cut short."""
    data = Path(path).read_bytes()
    if len(data) < _HEADER.size or not data.startswith(_MAGIC):
        raise InputError(f"{path}: not a Point Cache 2 file; it must begin with POINTCACHE2")
    _, _, points, _, _, samples = _HEADER.unpack_from(data)
    wanted = _HEADER.size + 12 * points * samples
    if len(data) != wanted:
        raise InputError(f"{path}: {len(data)} bytes, its header asks for {wanted}; write the file again")
    return (
        np.frombuffer(data, dtype="<f4", offset=_HEADER.size).reshape(samples, points, 3).astype(np.float32)
    )
