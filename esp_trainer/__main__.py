"""``python -m esp_trainer`` is ``esp-trainer``."""

import sys

from esp_trainer.cli import main

sys.exit(main())
