"""The paper's experiments over many seeds: what is run, what is measured, and what it says."""
