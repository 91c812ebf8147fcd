"""Enforced SubPopulations (Gomez & Miikkulainen 1997), for teams of agents with several networks each.

The package works on arrays and fitness alone; it does not depend on the world.
"""
