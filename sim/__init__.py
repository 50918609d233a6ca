"""The simulated world: bodies, motion, cloth, contact, datasets."""
