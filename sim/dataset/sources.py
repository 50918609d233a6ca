"""Whether what a scene names is there: body, motion, pattern."""

from __future__ import annotations

from collections.abc import Iterable

from muslin.garments import catalogue
from muslin.garments.pattern_file import read_pattern
from muslin.garments.template import resolution_of
from muslin.sim.body.load import load_body
from muslin.sim.fabric_file import is_fabric_file, read_fabric
from muslin.sim.motion_table import read_motion
from muslin.sim.scene import GarmentTable, MotionTable, Scene


def check_sources(scenes: Iterable[Scene]) -> None:
    """Read every body, motion and garment that the scenes name, each once.

    InputError for the first that is missing or cannot be: found out before the first sample is made, not
    when its turn comes.
    """
    known: set[str] = set()
    for scene in scenes:
        if scene.body is not None and _new(known, f"body {scene.body.model}"):
            load_body(scene.body.model)
        if scene.motion is not None and _new(known, f"motion {scene.motion!r}"):
            _check_motion(scene.motion)
        for garment in (scene.garment, *scene.layers):
            if _new(known, f"garment {garment!r}"):
                _check_garment(garment)
        choices = (scene.fabric, *(layer.fabric for layer in scene.layers))
        for fabric in {choice for choice in choices if isinstance(choice, str) and is_fabric_file(choice)}:
            read_fabric(fabric)


def _new(known: set[str], key: str) -> bool:
    if key in known:
        return False
    known.add(key)
    return True


def _check_motion(motion: MotionTable) -> None:
    clip = read_motion(motion)
    clip.clip(motion.start, clip.duration if motion.end is None else motion.end)


def _check_garment(garment: GarmentTable) -> None:
    if garment.pattern is not None:
        read_pattern(garment.pattern)
        return
    design = catalogue.get(garment.design)
    preset = {} if garment.preset is None else design.preset(garment.preset)
    design.complete(preset | garment.parameters)
    if garment.template is not None:
        resolution_of(garment.template)
