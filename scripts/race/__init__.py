"""The parts of ``scripts/prove_race.py``."""
