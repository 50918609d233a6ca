"""One file a remesher, each run in a process and, where need be, an environment of its own.

`python -m benchmarks.remeshers.NAME TASKS OUT` remeshes every task of a folder and writes what
`benchmarks.remeshers.exchange` says. Besides their own remesher, the peers' files import numpy alone.
"""
