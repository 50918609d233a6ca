"""Pictures of bodies and garments."""
