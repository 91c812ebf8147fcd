"""The game on small tori, solved exactly: a finite zero-sum game of simultaneous moves (Shapley 1953)."""
