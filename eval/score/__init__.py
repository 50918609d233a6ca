"""Families of metrics, fed frame by frame."""
