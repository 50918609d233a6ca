"""Garments on a parametric body: dressing, changing shape and pose, following a motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh
from muslin.sim.body.interior import MASK_GAP_M, masked_face_is_interior
from muslin.sim.body.model import BodyModel
from muslin.sim.cloth import ClothModel
from muslin.sim.contact.clearance import SelfClearance, room_for
from muslin.sim.contact.system import ContactSettings
from muslin.sim.dataset.intersections import crossed_body_faces
from muslin.sim.layers import dress
from muslin.sim.motion.rotations import axis_angle_from_quaternion, quaternion_from_axis_angle, slerp
from muslin.sim.remesh.in_loop import Remesher
from muslin.sim.solve.errors import SimulationError
from muslin.sim.solve.settings import SolverSettings, StepReport
from muslin.sim.solve.simulator import ClothSimulator

Tick = Callable[[], None] | None

MORPH_MOVE = 0.03
"""Largest move of a body vertex, metres, in one step of a change of shape or pose at rest."""

MORPH_DT = 1.0 / 30.0

ATTEMPTS = (1.0, 2.0, 0.5)
"""Shares of the room between parts of a body: where one leaves no way for the cloth, another may."""

REST_POSE = np.zeros((24, 3))


def a_pose() -> NDArray[np.float64]:
    """T-pose with the arms lowered by 45 degrees, 10 of them in the collar bones; (24, 3) axis-angle."""
    theta = np.zeros((24, 3))
    for collar, shoulder, sign in ((13, 16, -1.0), (14, 17, 1.0)):
        theta[collar, 2] = sign * np.radians(10.0)
        theta[shoulder, 2] = sign * np.radians(35.0)
    return theta


def advance_on_body(
    sim: ClothSimulator,
    clearance: SelfClearance,
    body: NDArray[np.float64],
    dt: float,
    *,
    inertia: bool = True,
) -> StepReport:
    """One time step of `dt` seconds in which the collider goes where the `body` (N, 3) now stands.

    Where parts of the body cut into each other it may go elsewhere: where it would squeeze cloth, along with
    the other part. If there is no way for the cloth, more and less room is tried: SimulationError, that of
    the first attempt, if that does not help.
    """
    stopped: SimulationError | None = None
    tried: NDArray[np.float64] | None = None
    for share in ATTEMPTS:
        target, sim.yielding = clearance.collider(body, sim.positions, sim.collider_vertices, share)
        if tried is not None and np.array_equal(target, tried):
            continue
        tried = target
        try:
            return sim.advance(target, dt, inertia=inertia)
        except SimulationError as error:
            stopped = stopped or error
    assert stopped is not None
    raise stopped


class WornGarment:
    """Garments, from inside out, on a body of shape `beta`, pose `theta` and `translation`: put on in the
    T-pose, and one cloth from then on."""

    def __init__(
        self,
        meshes: Sequence[GarmentMesh],
        cloths: Sequence[ClothModel],
        model: BodyModel,
        beta: NDArray[np.float64],
        contact: ContactSettings,
        solver: SolverSettings,
        device: str,
        tick: Tick = None,
    ) -> None:
        self.model = model
        self.beta = beta
        self.theta = REST_POSE
        self.translation = np.zeros(3)
        room = room_for(np.concatenate([cloth.rest_area for cloth in cloths]))
        self.clearance = SelfClearance(model.vertices(beta, REST_POSE), model.faces, device, room)
        self.sim = dress(meshes, cloths, model, beta, contact, solver, device, tick)
        self.remesher: Remesher | None = None

    def remesh(self) -> bool:
        """To be called after a time step: the mesh follows what the cloth does, if there is a `remesher`.
        Returns whether it is as it should be."""
        if self.remesher is None:
            return True
        self.remesher.step(self.sim)
        return self.remesher.calm

    def body(self) -> NDArray[np.float64]:
        """(N, 3) vertices of the body as it stands, metres."""
        return self.model.vertices(self.beta, self.theta, self.translation)

    def masked_faces(self) -> NDArray[np.int32]:
        """Faces of the body that the cloth, rounded to single precision, crosses: between parts of it.

        SimulationError if one is not there: the collider gave way more than it may.
        """
        body, faces = self.body(), self.model.faces
        changed = self.clearance.changed_faces(body, self.sim.collider_vertices)
        if len(changed) == 0:
            return changed
        cloth = self.sim.positions.astype(np.float32)
        crossed = changed[crossed_body_faces(cloth, self.sim.cloth.faces, body, faces[changed])]
        outside = crossed[~masked_face_is_interior(body, faces, crossed, MASK_GAP_M)]
        if len(outside):
            place = ", ".join(f"{value:.3f}" for value in body[faces[outside[0]]].mean(axis=0))
            raise SimulationError(
                f"cloth crosses {len(outside)} faces of the body that are not between parts of it, the first "
                f"at ({place}): parts of the body squeeze it; use a finer mesh, a looser garment or a slower "
                "motion"
            )
        return crossed

    def carry(self, theta: NDArray[np.float64], translation: NDArray[np.float64]) -> None:
        """Move body and garment together, as one rigid piece, to another root rotation and translation."""
        old = self.model.transforms(self.beta, self.theta, self.translation)[0]
        self.theta = np.concatenate([theta[:1], self.theta[1:]])
        self.translation = translation
        new = self.model.transforms(self.beta, self.theta, self.translation)[0]
        change = new @ np.linalg.inv(old)
        self.sim.turn_world(change[:3, :3], change[:3, 3])

    def morph(self, beta: NDArray[np.float64], theta: NDArray[np.float64], tick: Tick = None) -> None:
        """Change shape and pose at rest, in steps in which no body vertex moves more than `MORPH_MOVE`."""
        begin = (self.beta, self.theta)
        far = self.model.vertices(beta, theta, self.translation) - self.body()
        steps = max(1, int(np.ceil(np.linalg.norm(far, axis=1).max() / MORPH_MOVE)))
        for k in range(1, steps + 1):
            share = k / steps
            self.beta = (1.0 - share) * begin[0] + share * beta if k < steps else beta
            self.theta = (1.0 - share) * begin[1] + share * theta if k < steps else theta
            advance_on_body(self.sim, self.clearance, self.body(), MORPH_DT, inertia=False)
            if tick is not None:
                tick()

    def move(self, theta: NDArray[np.float64], translation: NDArray[np.float64], tick: Tick = None) -> None:
        """Go to another pose and place at rest: garment and body as one piece to the new root, then the other
        joints by slerp, in steps in which no body vertex moves more than `MORPH_MOVE`."""
        self.carry(theta, translation)
        far = self.model.vertices(self.beta, theta, translation) - self.body()
        steps = int(np.ceil(np.linalg.norm(far, axis=1).max() / MORPH_MOVE))
        begin, end = quaternion_from_axis_angle(self.theta), quaternion_from_axis_angle(theta)
        for k in range(1, steps + 1):
            share = np.array(k / steps)
            between = axis_angle_from_quaternion(slerp(begin, end, share)) if k < steps else theta
            self.follow(between, translation, MORPH_DT, inertia=False)
            if tick is not None:
                tick()

    def follow(
        self,
        theta: NDArray[np.float64],
        translation: NDArray[np.float64],
        dt: float,
        *,
        inertia: bool = True,
    ) -> None:
        """One time step of `dt` seconds in which the body goes to a new pose."""
        before = (self.theta, self.translation)
        self.theta, self.translation = theta, translation
        try:
            advance_on_body(self.sim, self.clearance, self.body(), dt, inertia=inertia)
        except Exception:
            self.theta, self.translation = before
            raise
