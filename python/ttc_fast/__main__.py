"""``python -m ttc_fast`` is ``ttc-fast``."""

import sys

from ttc_fast.cli import main

if __name__ == "__main__":
    sys.exit(main())
