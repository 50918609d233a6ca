"""Bodies of SMPL form: model, measurements, loaders."""

from muslin.sim.body.load import BODY_NAMES, load_body
from muslin.sim.body.model import BodyModel

__all__ = ["BODY_NAMES", "BodyModel", "load_body"]
