"""Measurements of ``bench_throughput.py`` and ``bench_peers.py``, and their tables."""
