"""muslin, with a scene file's own defaults: one implicit step a frame."""

from __future__ import annotations

from benchmarks.contenders.record import Record, contend
from benchmarks.garment import SCENE, cloth_model
from benchmarks.setting import DT, Setting
from muslin.sim.contact.clearance import SelfClearance, room_for
from muslin.sim.run import compile_kernels
from muslin.sim.scene import load_scene
from muslin.sim.setting import settings_of
from muslin.sim.solve.simulator import ClothSimulator


def simulate(setting: Setting) -> Record:
    """Every frame of the setting; the collider makes room where the body cuts into itself."""
    compile_kernels("cpu")
    contact, solver = settings_of(load_scene(SCENE))
    cloth = cloth_model(setting)
    clearance = SelfClearance(setting.body[0], setting.body_faces, "cpu", room_for(cloth.rest_area))
    collider = clearance.collider(setting.body[0], setting.positions)
    sim = ClothSimulator(cloth, setting.positions, collider, setting.body_faces, contact, solver)
    record = Record(("muslin", "warp-lang", "numpy"))
    record.options = {"max_iterations": solver.max_iterations, "contact_range": contact.range}
    for body in setting.body[1:]:
        with record.frame():
            sim.advance(clearance.collider(body, sim.positions, sim.collider_vertices), DT)
        record.add(sim.positions)
    return record


if __name__ == "__main__":
    contend(simulate)
