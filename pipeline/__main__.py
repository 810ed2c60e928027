"""``python -m pipeline`` is the command ``uxsim-geo``."""

import sys

from pipeline.cli import main

sys.exit(main())
