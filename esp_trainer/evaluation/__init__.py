"""Playing trials: compiled, or through PettingZoo's API."""
