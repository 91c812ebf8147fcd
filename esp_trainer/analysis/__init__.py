"""Looking at what evolved."""
