"""Bodies of SMPL form: model, measurements, loaders."""
