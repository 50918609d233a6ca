"""Contact: detection, barrier, friction, continuous collision detection."""
