"""What is stored of garments on a body, frame by frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh
from muslin.sim.certify import certify_rounded, solved
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.remeshed import sample_of_frames
from muslin.sim.dataset.sample import BodyTrack, Sample
from muslin.sim.motion.motion import Motion
from muslin.sim.relax import RestReport
from muslin.sim.scene import Scene
from muslin.sim.wear import WornGarment


class Recording:
    """Frames of one sample of worn garments, which were put on with the mesh `begun`."""

    def __init__(self, worn: WornGarment, begun: GarmentMesh) -> None:
        self._worn = worn
        self._begun = begun
        self._meshes: list[GarmentMesh] = []
        self._positions: list[NDArray[np.float64]] = []
        self._poses: list[NDArray[np.float64]] = []
        self._translations: list[NDArray[np.float64]] = []
        self._masked: list[NDArray[np.int32]] = []
        self._distance = np.inf

    def take(self) -> None:
        """Add a frame: cloth and body as they are now. SimulationError: the cloth is where it must not be."""
        worn = self._worn
        self._masked.append(worn.masked_faces())
        self._meshes.append(self._begun if worn.remesher is None else worn.remesher.mesh)
        self._positions.append(worn.sim.positions)
        self._poses.append(worn.theta)
        self._translations.append(worn.translation)
        self._distance = min(self._distance, worn.sim.contact.smallest_distance(worn.sim.x))

    def sample(
        self, scene: Scene, rest: RestReport | None, started: float, clip: Motion | None = None
    ) -> Sample:
        """The certified sample of the frames taken since `started`, a time of `time.perf_counter`."""
        assert scene.body is not None
        worn = self._worn
        track = BodyTrack(
            model=scene.body.model,
            digest=worn.model.digest,
            beta=worn.beta,
            poses=np.array(self._poses),
            translations=np.array(self._translations),
        )
        sample = sample_of_frames(
            self._meshes,
            self._positions,
            id=scene.name,
            kind="drape" if scene.motion is None else "sequence",
            certificate=Certificate(),
            fps=None if scene.motion is None else scene.motion.fps,
            body=track,
            masked_faces=tuple(self._masked),
            fabric="+".join(dict.fromkeys(fabric.name for fabric in worn.sim.cloth.fabrics)),
            scene=scene.model_dump(mode="json"),
            seed=scene.seed,
            labels={"sequence": clip.name, "motion_source": clip.source} if clip is not None else {},
        )
        frames = len(self._positions)
        return certify_rounded(sample, solved(scene, self._distance, rest, started, frames, worn.remesher))
