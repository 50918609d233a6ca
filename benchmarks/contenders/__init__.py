"""One file a simulator, each run in a process and, where need be, an environment of its own.

`python -m benchmarks.contenders.NAME SETTING OUT [--frames N]` simulates the setting and writes what
`benchmarks.contenders.record` says. Besides their own simulator these files import numpy alone.
"""
