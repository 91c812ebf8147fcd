"""Many runs from one small file: their plan, the workers that carry them out, and what came of them."""
