"""Other games than the predator-prey world, for ``game.environment``."""
