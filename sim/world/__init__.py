"""Cloth without a wearer: sheets, colliders, pins and what moves them."""
