"""The parts of ``compare_learners.py``."""
