"""Sewing patterns and the meshes cut from them."""
