"""Windows open where nobody sees them."""

import os

os.environ["SDL_VIDEODRIVER"] = "dummy"
