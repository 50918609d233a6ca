"""Blender's cloth modifier through `bpy`, self-collision on, at its default quality of 5 steps a frame.

Blender's clock and weights are its own. Measured on a free fall, a frame lasts 1/sqrt(1000) s at any frame
rate, so that `time_scale` = sqrt(1000) DT gives frames of DT, and a force counts a thousandfold. `mass` is
that of each vertex, M; so that accelerations come out right, stiffness is scaled by M over the mean mass m.

- stretch: an edge of mean length h pulls with 1000 tension (l - l0) / h. Springs of k = sqrt(3)/2 Y on
  equilateral triangles make a membrane of Young's modulus Y (Seung and Nelson 1988), here Y = c11 + c22, the
  mean of warp and weft; so tension = (sqrt(3)/2) Y h M / (1000 m). Poisson's ratio is the springs' 1/3.
- bending: an edge turns back with 100 bending h theta, a hinge of the fabric's table with k theta /
  (2 sqrt(3)) on equilateral triangles.
- friction: a hundredth of the slip for each unit, so 100 mu on cloth and body.

Rest lengths come from a shape in space: the setting's `free_positions`. Blender 5.0.1 does not heed
`rest_shape_key` where it evaluates a cloth modifier: results are the same to the last bit with and without.
So the mesh itself turns into that shape after the first frame, and `use_dynamic_mesh` takes lengths from it.
"""

from __future__ import annotations

import struct
import tempfile
from pathlib import Path

import bpy
import numpy as np

from benchmarks.contenders.record import Record, contend
from benchmarks.setting import DT, Setting

QUALITY = 5
COLLISION_QUALITY = 2
DISTANCE = 3.0e-3
VERTEX_MASS = 0.3


def simulate(setting: Setting) -> Record:
    """Every frame of the setting, played from frame 1 as an artist would; the body from a PC2 cache."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = round(1.0 / DT)
    scene.frame_start, scene.frame_end = 1, setting.frames + 1
    scene.gravity = (0.0, -9.81, 0.0)
    record = Record(("bpy", "numpy"))
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder, "body.pc2")
        _write_pc2(cache, setting.body)
        _add_body(setting, cache)
        cloth, record.options = _add_cloth(setting)
        scene.frame_set(1)
        for frame in range(2, setting.frames + 2):
            with record.frame():
                scene.frame_set(frame)
                evaluated = cloth.evaluated_get(bpy.context.evaluated_depsgraph_get())
                flat = np.empty(3 * len(setting.positions), np.float32)
                evaluated.data.vertices.foreach_get("co", flat)
            record.add(flat)
    return record


def _add_cloth(setting: Setting) -> tuple[bpy.types.Object, dict[str, object]]:
    """The cloth object with its modifier, and what was asked of it."""
    cloth = _add_object("cloth", setting.positions, setting.faces)
    cloth.shape_key_add(name="draped")
    free = cloth.shape_key_add(name="free")
    for frame in (1, 2):
        free.value = frame - 1.0
        free.keyframe_insert("value", frame=frame)
    free.data.foreach_set("co", setting.free_positions.astype(np.float32).ravel())

    h = _mean_edge(setting)
    scale = VERTEX_MASS / (1000.0 * setting.mass.mean())
    young = float(setting.stretch[0] + setting.stretch[2])
    tension = 0.5 * np.sqrt(3.0) * young * h * scale
    bending = float(setting.bend.mean()) / (2.0 * np.sqrt(3.0)) / (0.1 * h) * scale

    modifier = cloth.modifiers.new("cloth", "CLOTH")
    modifier.point_cache.frame_start, modifier.point_cache.frame_end = 1, setting.frames + 1
    s = modifier.settings
    s.quality = QUALITY
    s.time_scale = np.sqrt(1000.0) * DT
    s.mass = VERTEX_MASS
    s.tension_stiffness = s.compression_stiffness = tension
    s.bending_model = "ANGULAR"
    s.bending_stiffness = bending
    s.use_dynamic_mesh = True
    c = modifier.collision_settings
    c.use_collision = c.use_self_collision = True
    c.collision_quality = COLLISION_QUALITY
    c.distance_min = c.self_distance_min = DISTANCE
    c.friction = c.self_friction = 100.0 * float(setting.friction)
    return cloth, {"quality": QUALITY, "tension": tension, "bending": bending, "distance": DISTANCE}


def _add_body(setting: Setting, cache: Path) -> None:
    """The collider, its vertices played back from a cache file."""
    body = _add_object("body", setting.body[0], setting.body_faces)
    played = body.modifiers.new("cache", "MESH_CACHE")
    played.cache_format = "PC2"
    played.filepath = str(cache)
    played.frame_start = 1.0
    played.forward_axis, played.up_axis = "POS_Y", "POS_Z"
    body.modifiers.new("collision", "COLLISION")
    body.collision.thickness_outer = 0.5 * DISTANCE
    body.collision.cloth_friction = 100.0 * float(setting.friction)


def _add_object(name: str, vertices: np.ndarray, faces: np.ndarray) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    made = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(made)
    return made


def _mean_edge(setting: Setting) -> float:
    """Mean rest length of an edge, metres."""
    corners = setting.panel_vertices[setting.panel_faces]
    return float(np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=2).mean())


def _write_pc2(path: Path, frames: np.ndarray) -> None:
    """A point cache of frames (T, N, 3): header, then single precision."""
    count, points = frames.shape[:2]
    header = struct.pack("<12siiffi", b"POINTCACHE2\0", 1, points, 0.0, 1.0, count)
    path.write_bytes(header + frames.astype("<f4").tobytes())


if __name__ == "__main__":
    contend(simulate)
