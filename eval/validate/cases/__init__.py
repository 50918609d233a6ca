"""One module a case: its parameters, its known solution, how it is simulated and measured."""
