"""Reports: one or several runs as an HTML page that works offline, with a summary, charts, and a match player."""
