"""What ``bench_throughput.py`` and ``bench_peers.py`` measure, and how figures become a table."""
