"""One file a package that measures distances of surfaces, each run in a process and environment of its own.

`python -m benchmarks.surfaces.NAME PAIRS OUT` measures every pair of a folder and writes what
`benchmarks.surfaces.exchange` says. Besides their own package, the peers' files import numpy alone.
"""
