"""A benchmark for any policy: its results against evolved and scripted teams."""
