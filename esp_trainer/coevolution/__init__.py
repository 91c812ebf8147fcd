"""Two sides that evolve against each other."""
