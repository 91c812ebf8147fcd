"""Studies of optimal play on small tori."""
