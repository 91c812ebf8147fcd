"""The zoo: evolved teams that ship with the package, and their results against each other.

Teams come from several seeds and stages of the race, chosen and measured by ``scripts/make_zoo.py``. A name is
``PRESET/ROLE/seed-N-STAGE``. Teams whose names begin with ``held-out/`` are from seeds of their own and are for
reporting only: a policy that was trained or chosen against them can no longer be measured with them.
"""

from esp_trainer.teams.zoo import Zoo, ZooTeam, load_team, load_zoo

__all__ = ["Zoo", "ZooTeam", "load_team", "load_zoo"]
