"""What every training has in common: the loop, checkpoints, logs."""
