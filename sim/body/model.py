"""The body: shape blend shapes, pose blend shapes and linear blend skinning in SMPL's form."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sparse
from numpy.typing import ArrayLike, NDArray

from muslin.garments.errors import InputError
from muslin.sim.body.joints import NUM_JOINTS, NUM_POSE_FEATURES
from muslin.sim.body.rotation import rotation_matrices

Floats = NDArray[np.float64]

# Frames whose pose blend shapes are summed in one matrix product.
FRAMES_PER_BLOCK = 16


@dataclass(frozen=True, eq=False)
class BodyModel:
    """A human body of SMPL's form (Loper et al. 2015, "SMPL: A Skinned Multi-Person Linear Model").

        v(beta, theta) = sum_j w_j G_j(theta, J(beta)) [ T + S beta + P vec(R(theta) - I) ; 1 ]
        J(beta)        = J_0 + J_S beta

    | symbol | field | meaning |
    | --- | --- | --- |
    | T | v_template (V, 3) | mean body in T-pose, metres |
    | S | shapedirs (V, 3, B) | shape blend shapes, metres for one standard deviation |
    | P | posedirs (V, 3, 207) | pose blend shapes on the 23 rotations below the root, row-major R - I |
    | w | weights (V, 24) | skinning weights, non-negative, rows sum to one |
    | J_0, J_S | joint_template (24, 3), joint_shapedirs (24, 3, B) | joints in T-pose, affine in beta |
    | G_j | transforms() | rigid motion of joint j away from the T-pose |

    T-pose: y up, facing +z, left arm along +x, pelvis near the origin. The translation is added last, so
    the root turns about J_0(beta), not about the origin.

    Raises:
        InputError: arrays of the wrong shape, not finite, weights that are no partition of unity, parents
            that are no tree, or faces that index no vertex.
    """

    name: str
    v_template: Floats
    shapedirs: Floats
    posedirs: Floats
    weights: Floats
    parents: NDArray[np.int32]
    faces: NDArray[np.int32]
    joint_template: Floats
    joint_shapedirs: Floats
    source: str

    def __post_init__(self) -> None:
        _check_arrays(self)

    @property
    def num_vertices(self) -> int:
        return len(self.v_template)

    @property
    def num_betas(self) -> int:
        return self.shapedirs.shape[2]

    @cached_property
    def digest(self) -> str:
        """sha256 of every array, in hexadecimal: two models of equal digest give equal bodies."""
        sha = hashlib.sha256()
        for array in (self.v_template, self.shapedirs, self.posedirs, self.weights, self.parents, self.faces,
                      self.joint_template, self.joint_shapedirs):  # fmt: skip
            sha.update(f"{array.shape}{array.dtype.str}".encode())
            sha.update(np.ascontiguousarray(array).data)
        return sha.hexdigest()

    def rest_vertices(self, beta: ArrayLike | None = None) -> Floats:
        """T + S beta: the shaped body in T-pose, (..., V, 3)."""
        return self.v_template + _times_beta(self.shapedirs, self._checked_beta(beta))

    def rest_joints(self, beta: ArrayLike | None = None) -> Floats:
        """J(beta): the joints in T-pose, (..., 24, 3)."""
        return self.joint_template + _times_beta(self.joint_shapedirs, self._checked_beta(beta))

    def pose_offsets(self, theta: ArrayLike) -> Floats:
        """P vec(R(theta) - I): what a pose adds to the rest vertices before skinning, (..., V, 3)."""
        theta = _checked_theta(theta)
        features = (rotation_matrices(theta[..., 1:, :]) - np.eye(3)).reshape(-1, NUM_POSE_FEATURES)
        offsets = (self._pose_operator @ features.T).T
        return np.ascontiguousarray(offsets).reshape(*theta.shape[:-2], self.num_vertices, 3)

    def transforms(self, beta: ArrayLike | None, theta: ArrayLike, translation: ArrayLike = 0.0) -> Floats:
        """G_j: the motion of each joint away from the T-pose, translation included, (..., 24, 4, 4)."""
        rest, rotations, posed = self._posed_joints(beta, theta, translation)
        result = np.zeros((*posed.shape[:-1], 4, 4))
        result[..., :3, :3] = rotations
        result[..., :3, 3] = posed - np.einsum("...jk,...k->...j", rotations, rest)
        result[..., 3, 3] = 1.0
        return result

    def joints(
        self, beta: ArrayLike | None = None, theta: ArrayLike | None = None, translation: ArrayLike = 0.0
    ) -> Floats:
        """Positions of the posed joints, (..., 24, 3), metres."""
        return self._posed_joints(beta, _theta_or_rest(theta), translation)[2]

    def vertices(
        self, beta: ArrayLike | None = None, theta: ArrayLike | None = None, translation: ArrayLike = 0.0
    ) -> Floats:
        """The posed body.

        Args:
            beta: (..., n) with n <= num_betas, standard deviations; missing ones are zero. None: the mean.
            theta: (..., 24, 3) or (..., 72), rotation vectors, radians. None: the T-pose.
            translation: (..., 3) or a number, metres.

        Returns:
            (..., V, 3), metres. The leading dimensions of the three arguments broadcast.
        """
        beta, theta, translation = (
            self._checked_beta(beta),
            _theta_or_rest(theta),
            _checked_translation(translation),
        )
        transforms = self.transforms(beta, theta, translation)
        batch = transforms.shape[:-3]
        transforms = transforms.reshape(-1, NUM_JOINTS, 4, 4)
        theta = np.broadcast_to(theta, (*batch, NUM_JOINTS, 3)).reshape(-1, NUM_JOINTS, 3)
        # one beta for all frames, the usual case, is shaped once
        rest = self.rest_vertices(beta)
        if beta.ndim > 1:
            rest = np.broadcast_to(rest, (*batch, self.num_vertices, 3)).reshape(-1, self.num_vertices, 3)
        result = np.empty((len(theta), self.num_vertices, 3))
        for start in range(0, len(theta), FRAMES_PER_BLOCK):
            block = slice(start, start + FRAMES_PER_BLOCK)
            for frame, offsets in enumerate(self.pose_offsets(theta[block]), start):
                shaped = rest if rest.ndim == 2 else rest[frame]
                result[frame] = self._skinned(shaped + offsets, transforms[frame])
        return result.reshape(*batch, self.num_vertices, 3)

    def ground_offset(self, beta: ArrayLike | None = None, theta: ArrayLike | None = None) -> Floats:
        """Translation along y, metres, (...,), that puts the lowest vertex on the ground y = 0."""
        return -self.vertices(beta, theta)[..., 1].min(axis=-1)

    @cached_property
    def _pose_operator(self) -> NDArray[np.float64] | sparse.csr_array:
        # The default bodies' pose blend shapes are local and mostly zero; SMPL's own are dense.
        matrix = self.posedirs.reshape(-1, NUM_POSE_FEATURES)
        if np.count_nonzero(matrix) < 0.25 * matrix.size:
            return sparse.csr_array(matrix)
        return matrix

    @cached_property
    def _weight_operator(self) -> sparse.csr_array:
        return sparse.csr_array(self.weights)

    def _skinned(self, points: Floats, transforms: Floats) -> Floats:
        """sum_j w_j G_j [p; 1] of one frame: points (V, 3), transforms (24, 4, 4)."""
        blended = (self._weight_operator @ transforms[:, :3].reshape(NUM_JOINTS, 12)).reshape(-1, 3, 4)
        return np.einsum("vij,vj->vi", blended[..., :3], points) + blended[..., 3]

    def _posed_joints(
        self, beta: ArrayLike | None, theta: ArrayLike, translation: ArrayLike
    ) -> tuple[Floats, Floats, Floats]:
        """Rest joints, world rotations and world positions of the joints, equal leading dimensions."""
        rest, theta = self.rest_joints(beta), _checked_theta(theta)
        translation = _checked_translation(translation)
        batch = np.broadcast_shapes(rest.shape[:-2], theta.shape[:-2], translation.shape[:-1])
        rest = np.broadcast_to(rest, (*batch, NUM_JOINTS, 3))
        local = np.broadcast_to(rotation_matrices(theta), (*batch, NUM_JOINTS, 3, 3))
        rotations, positions = np.empty_like(local), np.empty_like(rest)
        rotations[..., 0, :, :] = local[..., 0, :, :]
        positions[..., 0, :] = rest[..., 0, :] + translation
        for joint in range(1, NUM_JOINTS):
            parent = self.parents[joint]
            rotations[..., joint, :, :] = rotations[..., parent, :, :] @ local[..., joint, :, :]
            bone = rest[..., joint, :] - rest[..., parent, :]
            turned = np.einsum("...ij,...j->...i", rotations[..., parent, :, :], bone)
            positions[..., joint, :] = positions[..., parent, :] + turned
        return rest, rotations, positions

    def _checked_beta(self, beta: ArrayLike | None) -> Floats:
        given = np.zeros(self.num_betas) if beta is None else np.asarray(beta, dtype=np.float64)
        if given.ndim == 0 or given.shape[-1] > self.num_betas:
            raise InputError(
                f"beta has shape {given.shape}; body '{self.name}' takes (..., n) with n <= {self.num_betas}"
            )
        if not np.isfinite(given).all():
            raise InputError(
                "beta holds NaN or infinity; give finite standard deviations, usually in [-3, 3]"
            )
        values = np.zeros((*given.shape[:-1], self.num_betas))
        values[..., : given.shape[-1]] = given
        return values


def _times_beta(directions: Floats, beta: Floats) -> Floats:
    """directions (..., B) times beta (..., B), the leading dimensions of beta first."""
    rows = directions.reshape(-1, beta.shape[-1])
    return (beta @ rows.T).reshape(*beta.shape[:-1], *directions.shape[:-1])


def _theta_or_rest(theta: ArrayLike | None) -> Floats:
    return np.zeros((NUM_JOINTS, 3)) if theta is None else _checked_theta(theta)


def _checked_theta(theta: ArrayLike) -> Floats:
    values = np.asarray(theta, dtype=np.float64)
    if values.shape[-1:] == (3 * NUM_JOINTS,):
        values = values.reshape(*values.shape[:-1], NUM_JOINTS, 3)
    if values.shape[-2:] != (NUM_JOINTS, 3):
        raise InputError(f"theta has shape {values.shape}; allowed are (..., 24, 3) and (..., 72), radians")
    if not np.isfinite(values).all():
        raise InputError("theta holds NaN or infinity; give finite rotation vectors in radians")
    return values


def _checked_translation(translation: ArrayLike) -> Floats:
    values = np.asarray(translation, dtype=np.float64)
    if values.ndim == 0:
        values = np.full(3, values)
    if values.shape[-1] != 3:
        raise InputError(f"translation has shape {values.shape}; allowed are (..., 3) and a number, metres")
    if not np.isfinite(values).all():
        raise InputError("translation holds NaN or infinity; give finite metres")
    return values


def _check_arrays(model: BodyModel) -> None:
    v, b = model.v_template.shape[0], model.shapedirs.shape[-1]
    shapes = {
        "v_template": (v, 3),
        "shapedirs": (v, 3, b),
        "posedirs": (v, 3, NUM_POSE_FEATURES),
        "weights": (v, NUM_JOINTS),
        "parents": (NUM_JOINTS,),
        "faces": (model.faces.shape[0], 3),
        "joint_template": (NUM_JOINTS, 3),
        "joint_shapedirs": (NUM_JOINTS, 3, b),
    }
    for key, expected in shapes.items():
        array = getattr(model, key)
        if array.shape != expected:
            raise InputError(f"{model.source}: {key} has shape {array.shape}; a body needs {expected}")
        if not np.isfinite(array).all():
            raise InputError(f"{model.source}: {key} holds NaN or infinity; the file is damaged")
    if v == 0 or len(model.faces) == 0:
        raise InputError(
            f"{model.source}: the body has {v} vertices and {len(model.faces)} faces; it is empty"
        )
    if model.faces.min() < 0 or model.faces.max() >= v:
        raise InputError(f"{model.source}: faces index {model.faces.max()} of {v} vertices")
    if model.weights.min() < -1e-9 or np.abs(model.weights.sum(axis=1) - 1.0).max() > 1e-3:
        raise InputError(f"{model.source}: skinning weights must be non-negative with rows that sum to 1")
    order = np.arange(NUM_JOINTS)
    if model.parents[0] != -1 or (model.parents[1:] < 0).any() or (model.parents[1:] >= order[1:]).any():
        raise InputError(f"{model.source}: parents {model.parents.tolist()} are no tree ordered from root 0")
