"""Elastic energies: each gives value, gradient and positive semi-definite Hessian blocks."""
