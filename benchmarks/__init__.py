"""The performance suite: muslin beside other cloth simulators, and muslin against its own goals."""
