"""How a run ends that cannot go on."""

from __future__ import annotations

from muslin.sim.solve.errors import LastState, SimulationError
from muslin.sim.solve.simulator import ClothSimulator


def stopped(where: str, error: SimulationError, sim: ClothSimulator) -> SimulationError:
    """The error with the scene and frame it came in, and the state to which `sim` went back."""
    state = LastState(
        positions=sim.positions,
        velocity=sim.velocity.copy(),
        faces=sim.cloth.faces,
        collider_vertices=sim.collider_vertices,
        collider_faces=sim.contact.collider_faces,
    )
    return SimulationError(f"{where}: {error}", state)
