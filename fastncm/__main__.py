"""`python -m fastncm`."""

import sys

from fastncm.cli import main

sys.exit(main())
