"""Metrics, comparison, reports and the command line."""
