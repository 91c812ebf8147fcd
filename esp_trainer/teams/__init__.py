"""The zoo: evolved teams that ship with the package, and who among them catches whom.

Teams come from several seeds and stages of the race, chosen and measured by ``scripts/make_zoo.py``. A name is
``PRESET/ROLE/seed-N-STAGE``. Those that begin with ``held-out/`` are from seeds of their own and are meant for
reporting only: who trains against them, or chooses by them, measures nothing any more.
"""

from esp_trainer.teams.zoo import Zoo, ZooTeam, load_team, load_zoo

__all__ = ["Zoo", "ZooTeam", "load_team", "load_zoo"]
