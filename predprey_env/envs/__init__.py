"""The world in the APIs of other tools: PettingZoo's parallel API, one team of it, and many worlds at once."""
