"""Measurements of growth: more trials, larger subpopulations, more workers, more runs."""
