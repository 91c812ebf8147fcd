"""Lines printed about a policy before it is measured."""

from __future__ import annotations

from esp_trainer.benchmark.specs import Candidate
from esp_trainer.cli.streams import say


def tell_about(candidate: Candidate) -> None:
    """Print the caution and the note about a candidate, if any, before it is measured."""
    if candidate.caution:
        say(f"caution: {candidate.caution}")
    if candidate.elsewhere:
        say(f"note: {candidate.elsewhere}")
