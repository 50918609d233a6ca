"""Implicit time stepping of one cloth among a moving collider, without ever passing through anything.

A step minimises the incremental potential

    E(x) = sum m |x - t|^2 (1 + a dt) / (2 dt^2) - m g.x + W_stretch + W_bend + B_contact + D_friction

by projected Newton: positive semi-definite Hessian, preconditioned conjugate gradients, every move limited by
continuous collision detection and backtracked until E falls. Vertices that are told where to go, the
collider's and the cloth's pins, move along with the iterations: what they still have to travel enters the
Newton direction, so that the cloth is carried, and the part that a safe step allows is made.

Sources: Li et al. 2020 (incremental potential contact); Gast, Schroeder 2014 (optimisation integrators).
"""

from __future__ import annotations

import numpy as np
import warp as wp
from numpy.typing import NDArray

from muslin.sim.air import AirDrag
from muslin.sim.cloth import ClothModel
from muslin.sim.contact.carry import Carry
from muslin.sim.contact.patches import Patches
from muslin.sim.contact.system import ContactSettings, ContactSystem
from muslin.sim.contact.yielding import yield_to_cloth
from muslin.sim.elastic import ElasticEnergy
from muslin.sim.solve.errors import SimulationError, blocked, out_of_budget
from muslin.sim.solve.inertia import quadratic_gradient, quadratic_value, step_along
from muslin.sim.solve.linear import LinearSystem
from muslin.sim.solve.settings import SolverSettings, StepReport


class ClothSimulator:
    """State of one cloth and one collider: positions, velocities, time stepping.

    `positions` (V, 3) and `collider_vertices` (N, 3), metres, must not intersect. `pins` (V,) marks vertices
    that go where `advance` tells them, `yielding` (N,) those of the collider that need not where they squeeze
    the cloth: there they go along with what is opposite. `work_left`: Newton iterations that may still be
    spent, for the caller to set; the step that would need more ends with SimulationError.
    """

    def __init__(
        self,
        cloth: ClothModel,
        positions: NDArray[np.float64],
        collider_vertices: NDArray[np.float64],
        collider_faces: NDArray[np.int32],
        contact: ContactSettings | None = None,
        solver: SolverSettings | None = None,
        device: str = "cpu",
    ) -> None:
        self.settings = solver or SolverSettings()
        self.device = device
        self._contact_settings = contact or ContactSettings()
        self.carry = Carry(collider_vertices, collider_faces, device) if len(collider_faces) else None
        self._scalar = wp.zeros(1, dtype=wp.float64, device=device)
        self.yielding = np.zeros(len(collider_vertices), bool)
        self.work_left = np.inf
        self._gravity = wp.vec3d(*self.settings.gravity)
        self._wear(cloth, np.concatenate([positions, collider_vertices]), collider_faces)

    def _wear(
        self,
        cloth: ClothModel,
        points: NDArray[np.float64],
        collider_faces: NDArray[np.int32],
        collider: Patches | None = None,
    ) -> None:
        """Make all that depends on the cloth, at rest and without pins at `points` (V + N, 3)."""
        self.cloth = cloth
        n, device = cloth.num_vertices, self.device
        self.elastic = ElasticEnergy(cloth, device, self.settings.damping)
        self.air = None if self.settings.air is None else AirDrag(cloth, self.settings.air, device)
        self.contact = ContactSystem(cloth, collider_faces, points, self._contact_settings, device, collider)
        self.linear = LinearSystem(cloth, device)
        self.x = wp.array(points, dtype=wp.vec3d, device=device)
        self.start, self.trial, self.p, self.remaining, self.base, self.uncut = (
            wp.zeros(len(points), dtype=wp.vec3d, device=device) for _ in range(6)
        )
        self.target, self.gradient = (wp.zeros(n, dtype=wp.vec3d, device=device) for _ in range(2))
        self.weight = wp.zeros(n, dtype=wp.float64, device=device)
        self.mass = wp.array(cloth.mass, dtype=wp.float64, device=device)
        self._energy_here: float | None = None
        self.velocity = np.zeros((n, 3))
        self.pins = np.zeros(n, bool)
        self.contact.search.renew(self.x)

    @property
    def positions(self) -> NDArray[np.float64]:
        """(V, 3) cloth positions, metres (a copy)."""
        return self.x.numpy()[: self.cloth.num_vertices].copy()

    @property
    def collider_vertices(self) -> NDArray[np.float64]:
        """(N, 3) collider positions, metres (a copy)."""
        return self.x.numpy()[self.cloth.num_vertices :].copy()

    def advance(
        self,
        collider_target: NDArray[np.float64] | None,
        dt: float,
        *,
        inertia: bool = True,
        friction: bool = True,
        pin_targets: NDArray[np.float64] | None = None,
    ) -> StepReport:
        """One time step of `dt` seconds while the collider moves straight to `collider_target` (N, 3).

        Vertices marked in `pins` move straight to their rows of `pin_targets` (V, 3), or stay where they are.
        Without `inertia` the velocity starts from rest: a proximal step towards equilibrium. A step in which
        collider and pins cannot arrive is retried as two half steps, up to `max_splits` deep; then
        SimulationError.
        """
        saved_x, saved_v = self.x.numpy().copy(), self.velocity.copy()
        goal = saved_x.copy()
        if collider_target is not None:
            goal[self.cloth.num_vertices :] = collider_target
        if pin_targets is not None:
            goal[: self.cloth.num_vertices][self.pins] = pin_targets[self.pins]
        report = StepReport()
        self.linear.fix(self.pins)
        try:
            self._advance(goal, dt, inertia, friction, report, self.settings.max_splits)
        except SimulationError:
            self.restore(saved_x, saved_v)
            raise
        return report

    def set_gravity(self, gravity: tuple[float, float, float]) -> None:
        """Acceleration of gravity from now on, m/s^2."""
        self._gravity = wp.vec3d(*gravity)

    def place(self, positions: NDArray[np.float64], collider_vertices: NDArray[np.float64]) -> None:
        """Put cloth and collider somewhere else, at rest; they must not intersect there."""
        self.restore(np.concatenate([positions, collider_vertices]), np.zeros_like(positions))
        self.contact.forget_friction()

    def replace_cloth(
        self,
        cloth: ClothModel,
        positions: NDArray[np.float64],
        velocity: NDArray[np.float64],
        held: NDArray[np.float64],
    ) -> None:
        """Go on with another mesh of the same cloth: (V', 3) positions, m, velocities, m/s, and what friction
        holds, m. Nothing is pinned then."""
        points = np.concatenate([positions, self.collider_vertices])
        self._wear(cloth, points, self.contact.collider_faces, self.contact.search.collider)
        self.velocity = velocity.copy()
        self.contact.friction.bristle.assign(held)

    @property
    def held(self) -> NDArray[np.float64]:
        """(V, 3) what friction holds, metres (a copy)."""
        return self.contact.friction.bristle.numpy().copy()

    def turn_world(self, turn: NDArray[np.float64], shift: NDArray[np.float64]) -> None:
        """Move everything as one rigid piece, what friction holds too: x -> turn x + shift, to rest."""
        self.restore(self.x.numpy() @ turn.T + shift, np.zeros_like(self.velocity))
        self.contact.turn_friction(turn)

    def restore(self, x: NDArray[np.float64], velocity: NDArray[np.float64]) -> None:
        """Put the joint vertex array (V + N, 3) and the velocities back to a saved, free state."""
        self.x.assign(x)
        self.velocity = velocity.copy()
        self.contact.search.renew(self.x)

    def _advance(
        self,
        goal: NDArray[np.float64],
        dt: float,
        inertia: bool,
        friction: bool,
        report: StepReport,
        splits: int,
    ) -> None:
        saved_x, saved_v = self.x.numpy().copy(), self.velocity.copy()
        if self._minimise(goal, dt, inertia, friction, report):
            return
        if splits == 0:
            led = self._led()
            left, way = (float(np.linalg.norm((goal - x)[led])) for x in (self.x.numpy(), saved_x))
            raise blocked(left / way, self.settings.max_splits, self.contact.tightest(self.x))
        self.restore(saved_x, saved_v)
        report.splits += 1
        middle = 0.5 * (saved_x + goal)
        self._advance(middle, 0.5 * dt, inertia, friction, report, splits - 1)
        self._advance(goal, 0.5 * dt, inertia, friction, report, splits - 1)

    def _minimise(
        self,
        goal: NDArray[np.float64],
        dt: float,
        inertia: bool,
        friction: bool,
        report: StepReport,
    ) -> bool:
        """The Newton iterations of one step; False if collider and pins do not arrive at their `goal`."""
        s = self.settings
        n = self.cloth.num_vertices
        begin = self.x.numpy().copy()
        self.start.assign(begin)
        self.elastic.begin_step(self.x)
        if self.air is not None:
            self.air.begin_step(self.x, self.velocity if inertia else np.zeros((n, 3)))
        self.contact.begin_step(self.x, friction)
        self._set_inertia(begin[:n], dt, inertia)
        self._energy_here = None
        led = self._led()
        remaining = np.where(led[:, None], goal - begin, 0.0)
        arrived = not np.abs(remaining).max(initial=0.0) > 0.0 or self._go_along(remaining)
        fraction = 1.0
        iterations = advances = relaxing = 0
        while True:
            if not arrived and relaxing == 0:
                safe = self._lead(remaining * fraction, led, dt, report)
                fraction *= 1.0 - safe
                advances += 1
                arrived = fraction < 1e-9
                if not arrived and advances >= s.max_advances:
                    return False
                relaxing = 0
                if safe < 0.5 and not arrived:
                    # Something is squeezed: let it give way before the collider goes on.
                    relaxing = s.relaxations
                    yield_to_cloth(self.contact, self.yielding, self.x, remaining)
                continue
            size, step = self._relax(led, dt, report)
            relaxing = max(relaxing - 1, 0)
            if not arrived:
                continue
            iterations += 1
            report.last_move, report.converged = step * size, size < s.tolerance
            solved = report.converged and iterations >= s.min_iterations
            # A direction along which nothing can be gained would come out the same again.
            if solved or step == 0.0 or iterations >= s.max_iterations:
                break
        self.velocity = (self.x.numpy()[:n] - begin[:n]) / dt if inertia else np.zeros((n, 3))
        self.contact.end_step(self.x, self.start)
        self.start.assign(self.x)
        return True

    def _go_along(self, remaining: NDArray[np.float64]) -> bool:
        """Move the collider all of its way, and the cloth near it with it, if that squeezes nothing.

        Not with pins: they pull on the cloth, and only the elastic energy knows how.
        """
        if self.carry is None or self.pins.any():
            return False
        self.remaining.assign(remaining)
        self.carry.moves(self.x, self.remaining, self.target, self.base, self.p)
        self.contact.search.cover(self.x, self.p)
        if self.contact.cut_to_safety(self.x, self.p, self._scalar, self.base) < 1.0:
            return False
        self._move(1.0)
        return True

    def _lead(self, way: NDArray[np.float64], led: NDArray[np.bool_], dt: float, report: StepReport) -> float:
        """Move collider and pins by what is safe of their `way` (V + N, 3); returns its share.

        The cloth goes where the Newton direction takes it that knows of the way.
        """
        s = self.settings
        self.remaining.assign(way)
        self._assemble(1.0 / dt)
        for guard in range(s.guards + 1):
            self._direction(way[led], led, report)
            safe = self.contact.largest_step(self.x, self.p, self._scalar)
            if safe >= 0.5 or guard == s.guards:
                break
            self.contact.add_guards(self.x, self.p, self.gradient, self.linear.matrix)
            if not self.linear.extras_fit():
                break
        self._move(safe)
        return safe

    def _relax(self, led: NDArray[np.bool_], dt: float, report: StepReport) -> tuple[float, float]:
        """One Newton iteration with collider and pins where they are: the largest move that it asks for, and
        the share of it that was made."""
        self.remaining.zero_()
        self._assemble(1.0 / dt)
        size, limit = self._direction(None, led, report)
        wp.copy(self.uncut, self.p)
        step = self._line_search(self.contact.cut_to_safety(self.x, self.p, self._scalar), 1.0 / dt)
        if step == 0.0:
            # Shortened here and there, the direction may not go downhill; as a whole it does.
            wp.copy(self.p, self.uncut)
            self.contact.search.cover(self.x, self.p)
            step = self._line_search(self.contact.largest_step(self.x, self.p, self._scalar), 1.0 / dt)
        return size, step * limit

    def _direction(
        self, told: NDArray[np.float64] | None, led: NDArray[np.bool_], report: StepReport
    ) -> tuple[float, float]:
        """Solve for the next move p, `told` or nothing where `led`, and list the contacts on its way.

        Returns the largest move of a cloth vertex before p was scaled, and the scale.
        """
        s = self.settings
        n = self.cloth.num_vertices
        if self.work_left <= 0:
            raise out_of_budget(self.contact.tightest(self.x))
        self.work_left -= 1
        # Where cloth is squeezed, a better direction saves attempts.
        tolerance = s.linear_tolerance * (1.0 if told is None else 0.1)
        args = [self.gradient, self.remaining, self.p, tolerance, s.max_linear_iterations]
        report.linear += self.linear.solve(*args)
        report.newton += 1
        # A copy: on the CPU numpy() is a view, and what follows would measure p after it was scaled.
        p = self.p.numpy().copy()
        p[led] = 0.0 if told is None else told
        size = float(np.sqrt((p[:n] ** 2).sum(axis=1).max()))
        if not np.isfinite(size):
            raise SimulationError("the Newton direction is not finite: the cloth has a collapsed triangle")
        limit = 1.0 if told is not None else min(1.0, s.max_move / max(size, 1e-30))
        if told is not None:
            # Squeezed cloth may ask to go anywhere: no further than what leads it and `max_move`.
            bound = s.max_move + np.linalg.norm(told, axis=1).max(initial=0.0)
            p[:n] *= bound / np.maximum(np.linalg.norm(p[:n], axis=1, keepdims=True), bound)
        self.p.assign(p * limit)
        self.contact.search.cover(self.x, self.p)
        return size, limit

    def _led(self) -> NDArray[np.bool_]:
        """Which vertices of the joint array are told where to go: pins and collider."""
        return np.concatenate([self.pins, np.ones(len(self.x) - self.cloth.num_vertices, bool)])

    def _set_inertia(self, begin: NDArray[np.float64], dt: float, inertia: bool) -> None:
        drag = 1.0 + self.settings.drag * dt
        weight = self.cloth.mass / dt**2 * drag
        target = begin + (dt / drag) * self.velocity if inertia else begin.copy()
        self.weight.assign(weight)
        self.target.assign(target)

    def forces_at_rest(self, dt: float) -> NDArray[np.float64]:
        """(V, 3) forces on the cloth if it stood still, N: elastic, contact and gravity, and friction as it
        stood at the start of the last step of `dt` seconds; no inertia."""
        saved = self.weight.numpy().copy()
        self.weight.zero_()
        self.remaining.zero_()
        self._assemble(1.0 / dt)
        self.weight.assign(saved)
        return -self.gradient.numpy()

    def _assemble(self, inverse_dt: float) -> None:
        while True:
            self.linear.clear()
            self.gradient.zero_()
            args = [self.x, self.target, self.weight, self.mass, self._gravity, self.gradient]
            wp.launch(quadratic_gradient, self.cloth.num_vertices, args, device=self.device)
            self.linear.add_diagonal(self.weight)
            self.elastic.add_derivatives(self.x, inverse_dt, self.gradient, self.linear.matrix)
            if self.air is not None:
                self.air.add_derivatives(self.x, self.start, inverse_dt, self.gradient, self.linear.matrix)
            matrix = self.linear.matrix
            self.contact.add_derivatives(self.x, self.start, self.remaining, self.gradient, matrix)
            if self.linear.extras_fit():
                return

    def _energy(self, x: wp.array, step: float, inverse_dt: float) -> float:
        """Value of the potential at x, which is `step` p away from where the vertices are."""
        self._scalar.zero_()
        args = [x, self.target, self.weight, self.mass, self._gravity, self._scalar]
        wp.launch(quadratic_value, self.cloth.num_vertices, args, device=self.device)
        self.elastic.add_value(x, inverse_dt, self._scalar)
        if self.air is not None:
            self.air.add_value(x, self.start, inverse_dt, self._scalar)
        self.contact.add_value(x, step, self.start, self._scalar)
        return float(self._scalar.numpy()[0])

    def _go(self, step: float) -> None:
        """trial = x + step p"""
        wp.launch(step_along, len(self.x), [self.x, self.p, step, self.trial], device=self.device)

    def _move(self, step: float) -> None:
        """Go `step` p, wherever the energy goes."""
        self._go(step)
        self.x, self.trial = self.trial, self.x
        self.contact.lower_distances(step)
        self.contact.search.spend()
        self._energy_here = None

    def _line_search(self, step: float, inverse_dt: float) -> float:
        """Backtrack from `step` until the energy falls; zero if it never does."""
        if self._energy_here is None:
            self._energy_here = self._energy(self.x, 0.0, inverse_dt)
            self.contact.accept_trial()
        for _ in range(self.settings.max_backtracks):
            self._go(step)
            energy = self._energy(self.trial, step, inverse_dt)
            if energy < self._energy_here:
                self.x, self.trial = self.trial, self.x
                self.contact.accept_trial()
                self.contact.search.spend()
                self._energy_here = energy
                return step
            step *= 0.5
        return 0.0
