"""Sweeps: many runs from one small file. Their plan, the workers that carry them out, and their results."""
