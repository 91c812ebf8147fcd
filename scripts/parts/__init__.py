"""Replaced parts, measured: what other algorithms, senses and networks do to a race."""
