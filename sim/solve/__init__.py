"""Linear solver, Newton minimisation, time stepping."""
