"""Learned drapes: the only package that imports torch."""
