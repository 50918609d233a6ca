"""What the tables of a scene stand for: garment meshes, fabrics, settings of solver and contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from muslin.garments import catalogue
from muslin.garments.merge import merge_meshes
from muslin.garments.mesh import GarmentMesh
from muslin.garments.pattern_file import read_pattern
from muslin.garments.template import template
from muslin.garments.triangulate import triangulate
from muslin.sim.air import AirSettings
from muslin.sim.cloth import ClothModel, build_cloth
from muslin.sim.contact.system import ContactSettings
from muslin.sim.fabric_file import is_fabric_file, read_fabric
from muslin.sim.material import Fabric, isotropic_fabric, load_fabric
from muslin.sim.scene import FabricScale, GarmentTable, IsotropicTable, LayerTable, Scene
from muslin.sim.solve.settings import SolverSettings
from muslin.sim.topologies import retriangulated
from muslin.sim.world.placing import copies


@dataclass(frozen=True, eq=False)
class Garment:
    """One garment of a scene, called by a name of its own, `shift` (3,) m from where its table puts it."""

    name: str
    table: GarmentTable
    mesh: GarmentMesh
    fabric: Fabric
    shift: NDArray[np.float64]

    @property
    def cloth(self) -> ClothModel:
        return build_cloth(self.mesh, self.fabric)


def garments_of(scene: Scene) -> list[Garment]:
    """All garments from inside out; copies share mesh and fabric."""
    tables: list[GarmentTable] = [scene.garment, *scene.layers]
    found = []
    for table in tables:
        fabric, mesh = fabric_of(scene, table), _mesh(scene, table)
        found += [(table, mesh, fabric, shift) for shift in copies(table.repeat)]
    names = [table.preset or mesh.name for table, mesh, _, _ in found]
    twice = {name for name in names if names.count(name) > 1}
    own = [f"{name}-{k}" if name in twice else name for k, name in enumerate(names)]
    return [Garment(name, *parts) for name, parts in zip(own, found, strict=True)]


def cut_garment(scene: Scene) -> GarmentMesh:
    """The mesh of all garments of a scene."""
    garments = garments_of(scene)
    return merge_meshes([g.name for g in garments], [g.mesh for g in garments])


def fabric_of(scene: Scene, table: GarmentTable) -> Fabric:
    """The fabric of one garment."""
    choice, scale = scene.fabric, scene.fabric_scale
    if isinstance(table, LayerTable):
        if table.fabric is not None:
            choice, scale = table.fabric, FabricScale()
        scale = table.fabric_scale or scale
    return load_choice(choice).scaled(scale.density, scale.stretch, scale.bend)


def load_choice(choice: str | IsotropicTable) -> Fabric:
    """The fabric that a scene's `fabric` means."""
    if isinstance(choice, IsotropicTable):
        return isotropic_fabric(choice.young, choice.poisson, choice.thickness, choice.density)
    return read_fabric(choice) if is_fabric_file(choice) else load_fabric(choice)


def settings_of(scene: Scene) -> tuple[ContactSettings, SolverSettings]:
    """Contact and solver as the scene has them."""
    s = scene.solver
    contact = ContactSettings(
        range=s.contact_range,
        stiffness=s.contact_stiffness,
        friction_body=scene.friction_body,
        friction_cloth=scene.friction_cloth,
    )
    solver = SolverSettings(
        gravity=scene.gravity,
        damping=s.damping,
        drag=s.drag,
        tolerance=s.tolerance,
        max_iterations=s.max_iterations,
        air=None if scene.air is None else AirSettings(**scene.air.model_dump()),
    )
    return contact, solver


def _mesh(scene: Scene, table: GarmentTable) -> GarmentMesh:
    """The mesh of one garment that is simulated."""
    mesh = _cut(table)
    if scene.topology is None or scene.topology.fit:
        return mesh
    return retriangulated(mesh, scene.topology).mesh


def _cut(g: GarmentTable) -> GarmentMesh:
    if g.pattern is not None:
        return triangulate(read_pattern(g.pattern), g.edge_length, g.seed)
    design = catalogue.get(g.design)
    parameters = {**(design.preset(g.preset) if g.preset is not None else {}), **g.parameters}
    if g.template is not None:
        return template(g.design, parameters, g.template)
    return triangulate(design.pattern(**parameters), g.edge_length, g.seed)
