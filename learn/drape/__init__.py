"""Static drapes: the pipeline of graph networks, its baselines and what trains them."""
