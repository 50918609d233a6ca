"""Datasets of simulated samples: schema, storage, generation, verification."""
