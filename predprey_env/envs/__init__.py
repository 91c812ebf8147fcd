"""The world as other tools know it: PettingZoo's parallel API, one team of it, and many worlds at once."""
