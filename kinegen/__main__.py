"""`python -m kinegen`: the same as the command `kinegen`."""

import sys

from kinegen.ui.cli import main

if __name__ == "__main__":
    sys.exit(main())
