"""``python -m skfem_dual``."""

import sys

from .cli import main

if __name__ == "__main__":
    sys.exit(main())
