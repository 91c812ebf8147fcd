"""The rules of the world, each stated once, over values: one world, or sixteen side by side."""
