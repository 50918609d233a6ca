"""Benchmarks: protocols that score any number of methods on the same samples."""
