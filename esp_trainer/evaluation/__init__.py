"""Evaluators, which play trials: compiled, or through PettingZoo's API."""
