"""Coevolution of two sides, each evolving against the other."""
