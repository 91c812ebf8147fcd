"""A run on disk: the training loop, its checkpoints and its champions."""
