"""Frames of different topologies as one batch: one graph of unconnected parts, as graph libraries have it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import torch

from muslin.garments.errors import InputError

_COUNTED = {
    "positions": "vertex",
    "faces": "face",
    "panel_faces": "face",
    "face_panel": "face",
    "panel_vertices": "panel_vertex",
    "panel_to_vertex": "panel_vertex",
    "uv": "panel_vertex",
    "body_vertices": "body_vertex",
    "body_faces": "body_face",
}
"""What the first dimension of each array counts."""
_INDEXES = {
    "faces": "vertex",
    "panel_faces": "panel_vertex",
    "panel_to_vertex": "vertex",
    "body_faces": "body_vertex",
}
"""Whose places the entries of an array are."""


def collate(frames: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """One batch of B frames, as `FrameDataset` and `FrameStream` give them.

    Arrays over vertices, faces and so on are put one after the other, and indices are moved along, so that
    `batch["positions"][batch["faces"]]` are the triangles of all frames.

    | key | shape | meaning |
    | --- | --- | --- |
    | `positions`, `faces`, `panel_vertices`, … | (sum over frames, …) | frame after frame |
    | `vertex_ptr`, `face_ptr`, `panel_vertex_ptr`, … | (B + 1,) int64 | where each frame begins; the end |
    | `vertex_batch` | (sum of V,) int64 | frame of each vertex, 0 to B - 1 |
    | `pose`, `translation`, `frame`, `fps` | (B, …) | stacked |
    | `beta` | (B, n) | stacked; shorter ones end with zeros |
    | `sample`, `design`, … | list of B str | |

    Raises InputError if there is no frame, or one lacks what another has.
    """
    if not frames:
        raise InputError("a batch of no frames; give at least one")
    for frame in frames:
        if frame.keys() != frames[0].keys():
            key = sorted(frame.keys() ^ frames[0].keys())[0]
            raise InputError(
                f"samples {frames[0]['sample']} and {frame['sample']}: only one of them has {key!r}; select "
                "samples of one kind, e.g. where={'body': 'female'}"
            )
    starts = {
        counted: _starts([len(frame[key]) for frame in frames])
        for key, counted in _COUNTED.items()
        if key in frames[0]
    }
    batch: dict[str, Any] = {}
    for key, first in frames[0].items():
        values = [frame[key] for frame in frames]
        if key in _INDEXES:
            offsets = starts[_INDEXES[key]].tolist()
            batch[key] = torch.cat([value + offset for value, offset in zip(values, offsets, strict=False)])
        elif key in _COUNTED:
            batch[key] = torch.cat(values)
        elif key == "beta":
            batch[key] = torch.nn.utils.rnn.pad_sequence(values, batch_first=True)
        elif isinstance(first, torch.Tensor):
            batch[key] = torch.stack(values)
        else:
            batch[key] = values if isinstance(first, str) else torch.tensor(values)
    vertices = starts["vertex"].diff()
    batch |= {f"{counted}_ptr": start for counted, start in starts.items()}
    return batch | {"vertex_batch": torch.repeat_interleave(torch.arange(len(frames)), vertices)}


def _starts(counts: list[int]) -> torch.Tensor:
    return torch.tensor([0, *counts]).cumsum(0)
