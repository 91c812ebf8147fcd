"""A run, or several, as one HTML page that works offline: the story, charts, and a player of any of its matches."""
