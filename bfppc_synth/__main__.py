"""``python -m bfppc_synth`` is the command ``bfppc-synth``."""

from __future__ import annotations

import sys

from bfppc_synth.cli import main

if __name__ == "__main__":
    sys.exit(main())
