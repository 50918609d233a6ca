"""Animated garments: displacement maps over the uv layout, and diffusion models that draw them."""
