"""Analysis of what evolved: cross-play, progress, games, phases, behaviours, and statistics over seeds."""
