"""The parts of ``learning_curves.py``."""
