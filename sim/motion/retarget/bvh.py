"""Biovision hierarchy (.bvh): a skeleton of offsets and Euler channels, one line of values a frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from muslin.garments.errors import InputError
from muslin.sim.motion.retarget.source import SourceMotion
from muslin.sim.motion.rotations import multiply, quaternion_from_axis_angle, rotate

_AXIS = {"X": 0, "Y": 1, "Z": 2}


def read_bvh(path: str | Path, source: str) -> SourceMotion:
    """Read a BVH file whose skeleton stands y up and faces +z, as CMU's conversions do.

    Rotation channels multiply in the order they are listed: `Zrotation Yrotation Xrotation` is
    R_z R_y R_x, in degrees. End sites are kept as joints named after their parent with `_end`.
    """
    path = Path(path)
    words = path.read_text(encoding="ascii").split()
    if "MOTION" not in words or words[0] != "HIERARCHY":
        raise InputError(f"{path}: not a BVH file; it must hold HIERARCHY and MOTION")
    split = words.index("MOTION")
    names, parents, offsets, channels = _hierarchy(words[:split])
    frames, frame_time = int(words[split + 2]), float(words[split + 5])
    values = np.array(words[split + 6 :], dtype=np.float64).reshape(frames, -1)
    if values.shape[1] != sum(len(c) for c in channels):
        raise InputError(f"{path}: {values.shape[1]} values a frame; the channels ask for another number")

    rotations = np.empty((frames, len(names), 4))
    positions = np.empty((frames, len(names), 3))
    rest = np.zeros((len(names), 3))
    column = 0
    for joint, parent in enumerate(parents):
        local = np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1))
        shift = np.tile(offsets[joint], (frames, 1))
        for channel in channels[joint]:
            axis = _AXIS[channel[0]]
            if channel.endswith("position"):
                shift[:, axis] += values[:, column]
            else:
                turn = np.radians(values[:, column, None]) * np.eye(3)[axis]
                local = multiply(local, quaternion_from_axis_angle(turn))
            column += 1
        if parent < 0:
            rotations[:, joint], positions[:, joint], rest[joint] = local, shift, offsets[joint]
            continue
        rotations[:, joint] = multiply(rotations[:, parent], local)
        positions[:, joint] = positions[:, parent] + rotate(rotations[:, parent], shift)
        rest[joint] = rest[parent] + offsets[joint]
    # The frame time is written with few digits: .0083333 is 120 frames a second.
    fps = float(np.round(1.0 / frame_time, 2))
    return SourceMotion(path.stem, tuple(names), rest, rotations, positions, fps, source)


def _hierarchy(words: list[str]) -> tuple[list[str], list[int], list[np.ndarray], list[list[str]]]:
    names: list[str] = []
    parents: list[int] = []
    offsets: list[np.ndarray] = []
    channels: list[list[str]] = []
    open_joints: list[int] = []
    position = 1
    while position < len(words):
        word = words[position]
        if word in ("ROOT", "JOINT", "End"):
            parents.append(open_joints[-1] if open_joints else -1)
            names.append(f"{names[parents[-1]]}_end" if word == "End" else words[position + 1])
            channels.append([])
            open_joints.append(len(names) - 1)
            position += 3
        elif word == "OFFSET":
            offsets.append(np.array(words[position + 1 : position + 4], dtype=np.float64))
            position += 4
        elif word == "CHANNELS":
            count = int(words[position + 1])
            channels[open_joints[-1]] = words[position + 2 : position + 2 + count]
            position += 2 + count
        elif word == "}":
            open_joints.pop()
            position += 1
        else:
            raise InputError(f"BVH hierarchy: unexpected word {word!r}")
    return names, parents, offsets, channels
