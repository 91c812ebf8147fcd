"""Mutation testing: the making of mutants, their running, and the page on them."""
