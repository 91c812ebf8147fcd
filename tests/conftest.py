"""Windows open where nobody sees them, and Ctrl-C is heard."""

import os
import signal

os.environ["SDL_VIDEODRIVER"] = "dummy"
# A shell that starts the tests in the background has it ignored, by all that they start too.
signal.signal(signal.SIGINT, signal.default_int_handler)
