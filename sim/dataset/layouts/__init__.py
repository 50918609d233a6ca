"""Whole datasets in the folders and files that others' programs read."""
