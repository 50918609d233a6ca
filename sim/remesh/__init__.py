"""Adaptive remeshing in panel space: topology as a choice, and detail where the cloth needs it."""
