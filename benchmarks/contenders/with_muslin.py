"""muslin, with a scene file's own defaults: one implicit step a frame."""

from __future__ import annotations

from benchmarks.contenders.record import Record, contend
from benchmarks.garment import walk
from benchmarks.setting import DT, Setting
from muslin.sim.run import compile_kernels
from muslin.sim.wear import advance_on_body


def simulate(setting: Setting) -> Record:
    """Every frame of the setting; the collider makes room where the body cuts into itself."""
    compile_kernels("cpu")
    sim, clearance = walk(setting)
    record = Record(("muslin", "warp-lang", "numpy"))
    record.options = {
        "max_iterations": sim.settings.max_iterations,
        "contact_range": sim.contact.settings.range,
    }
    for body in setting.body[1:]:
        with record.frame():
            advance_on_body(sim, clearance, body, DT)
        record.add(sim.positions)
    return record


if __name__ == "__main__":
    contend(simulate)
