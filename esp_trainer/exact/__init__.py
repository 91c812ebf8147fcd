"""Exact solution of the game on small tori: a finite zero-sum game of simultaneous moves (Shapley 1953)."""
