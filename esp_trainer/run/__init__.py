"""A run on disk: the loop, its checkpoints, its champions."""
