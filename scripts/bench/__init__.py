"""What ``bench_throughput.py`` measures: the alternatives, the workload, and how figures become a table."""
