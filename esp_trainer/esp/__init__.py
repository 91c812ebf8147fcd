"""Enforced SubPopulations (Gomez & Miikkulainen 1997), for teams of agents with several networks each.

Sees arrays and fitness only; knows no world.
"""
