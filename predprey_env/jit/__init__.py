"""What rules are written with and compiled by: values in lanes, exact float operations, a cache of machine code."""
