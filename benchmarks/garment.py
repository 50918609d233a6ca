"""The setting's cloth, and its walk, as muslin's own types."""

from __future__ import annotations

import numpy as np

from benchmarks.setting import Setting
from muslin.garments.mesh import GarmentMesh
from muslin.sim.cloth import ClothModel, build_cloth
from muslin.sim.contact.clearance import SelfClearance, room_for
from muslin.sim.scene import load_scene
from muslin.sim.setting import fabric_of, settings_of
from muslin.sim.solve.simulator import ClothSimulator

SCENE = "scenes/tshirt_walk.toml"


def garment(setting: Setting) -> GarmentMesh:
    """Its mesh; panels' names and uv layout play no part in simulation."""
    panel_to_vertex = np.empty(len(setting.panel_vertices), np.int32)
    panel_to_vertex[setting.panel_faces] = setting.faces
    return GarmentMesh(
        faces=setting.faces,
        panel_faces=setting.panel_faces,
        panel_vertices=setting.panel_vertices,
        panel_to_vertex=panel_to_vertex,
        face_panel=np.zeros(len(setting.faces), np.int32),
        panel_names=("cloth",),
        uv=np.zeros_like(setting.panel_vertices),
        name="setting",
        parameters={},
    )


def cloth_model(setting: Setting) -> ClothModel:
    """Its rest geometry in the fabric of the scene."""
    scene = load_scene(SCENE)
    return build_cloth(garment(setting), fabric_of(scene, scene.garment))


def walk(setting: Setting) -> tuple[ClothSimulator, SelfClearance]:
    """Its first frame, with the settings of the scene, and what makes colliders of its bodies."""
    contact, solver = settings_of(load_scene(SCENE))
    cloth = cloth_model(setting)
    clearance = SelfClearance(setting.body[0], setting.body_faces, "cpu", room_for(cloth.rest_area))
    collider = clearance.collider(setting.body[0], setting.positions).vertices
    sim = ClothSimulator(cloth, setting.positions, collider, setting.body_faces, contact, solver)
    return sim, clearance
