"""Moving surfaces as text that a page can carry: few bytes, and what it costs in accuracy is known.

Positions. q = round((p - low) / step), one step for the three axes, so the error of a coordinate is step / 2.
step = max(extent / 65535, min(resolution, extent / 4095)): not finer than is useful, never more than 16 bits.
Of q_t,i (frame t, vertex i, one axis) goes out
    r_t,i = (q_t,i - q_t-1,i) - (q_t,i-1 - q_t-1,i-1)   (mod 2^16)
with q_t-1 = 0 where the topology is new, because neighbours in the list of vertices tend to move alike;
axis after axis, frame after frame.
Values. c = round(255 sqrt(v / top)) with the track's largest value as top: an error of at most
top (sqrt(v / top) + 1/1020) / 255, small for small values. The same r, mod 2^8.
Faces. Differences of successive vertex numbers, in 32 bits.
All r are zigzagged (0, -1, 1, -2, ... to 0, 1, 2, 3, ...), split into planes of low and high bytes, deflated
(RFC 1950) and written in base64. The decoder is assets/decode.js.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from muslin.eval.viewer.scene import MovingMesh

LEVEL = 6
LARGEST = 65535
CLOTH_RESOLUTION = 5e-5  # metres
BODY_RESOLUTION = 1e-4


def encode_mesh(mesh: MovingMesh, resolution: float = CLOTH_RESOLUTION) -> dict[str, Any]:
    """A moving surface as what the page holds of it, ready for JSON. Expects a validated mesh."""
    topologies, of_frame = distinct_topologies(mesh.faces)
    low = np.min([np.min(p, axis=0) for p in mesh.positions], axis=0).astype(np.float64)
    extent = float((np.max([np.max(p, axis=0) for p in mesh.positions], axis=0) - low).max())
    step = max(extent / LARGEST, min(resolution, extent / 4095)) or 1.0
    quantised = [np.rint((np.asarray(p, dtype=np.float64) - low) / step).T for p in mesh.positions]
    sizes = {kind: len(p) for kind, p in zip(of_frame, mesh.positions, strict=True)}
    encoded = {
        "topologies": [
            {"vertices": sizes[kind], "faces": len(faces), "data": pack(differences(faces), 4)}
            for kind, faces in enumerate(topologies)
        ],
        "frames": of_frame,
        "low": low.tolist(),
        "step": step,
        "positions": pack(_residuals(quantised, of_frame, 16), 2),
        "values": None,
        "top": 0.0,
    }
    if mesh.values is not None:
        top = max(float(np.max(v)) for v in mesh.values)
        scale = 1.0 / top if top else 0.0
        levels = [np.rint(255.0 * np.sqrt(np.asarray(v) * scale))[None] for v in mesh.values]
        encoded |= {"values": pack(_residuals(levels, of_frame, 8), 1), "top": top}
    return encoded


def distinct_topologies(faces: Sequence[np.ndarray]) -> tuple[list[np.ndarray], list[int]]:
    """Faces that differ, and for each frame which of them it has."""
    known: dict[bytes, int] = {}
    by_object: dict[int, int] = {}
    distinct: list[np.ndarray] = []
    of_frame: list[int] = []
    for entry in faces:
        if id(entry) not in by_object:
            triangles = np.ascontiguousarray(entry, dtype=np.int32)
            kind = known.setdefault(triangles.tobytes(), len(known))
            if kind == len(distinct):
                distinct.append(triangles)
            by_object[id(entry)] = kind
        of_frame.append(by_object[id(entry)])
    return distinct, of_frame


def differences(faces: np.ndarray) -> np.ndarray:
    """Zigzagged differences of successive vertex numbers (3F,), uint32."""
    return zigzag(np.diff(faces.ravel().astype(np.int64), prepend=0), 32)


def _residuals(frames: Sequence[np.ndarray], of_frame: Sequence[int], bits: int) -> np.ndarray:
    """r of the module's head for frames (axes, V_t) of whole numbers, zigzagged, one after the other."""
    residuals = []
    previous: np.ndarray | int = 0
    for t, frame in enumerate(frames):
        if t and of_frame[t] != of_frame[t - 1]:
            previous = 0
        change = frame - previous
        residuals.append(np.diff(change, axis=1, prepend=0.0).ravel())
        previous = frame
    return zigzag(np.concatenate(residuals).astype(np.int64), bits)


def zigzag(numbers: np.ndarray, bits: int) -> np.ndarray:
    """Numbers mod 2^bits, the ones near zero small whatever their sign."""
    signed = numbers.astype(f"<i{bits // 8}")
    return ((signed << 1) ^ (signed >> (bits - 1))).astype(f"<u{bits // 8}")


def pack(numbers: np.ndarray, size: int) -> str:
    """Unsigned numbers of `size` bytes as text: all lowest bytes, then the next, deflated, in base64."""
    planes = numbers.astype(f"<u{size}").view(np.uint8).reshape(-1, size).T
    return base64.b64encode(zlib.compress(np.ascontiguousarray(planes).tobytes(), LEVEL)).decode()
