"""Coevolution of predator and prey teams by Enforced SubPopulations (Rawal, Rajagopalan & Miikkulainen 2010)."""

from esp_trainer.config import RunConfig
from esp_trainer.esp.team import Team
from esp_trainer.presets import PRESETS, preset
from esp_trainer.teams import load_team

__all__ = ["PRESETS", "RunConfig", "Team", "load_team", "preset"]
