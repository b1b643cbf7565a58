"""``python -m imucal_wizard``."""

import sys

from imucal_wizard.cli import main

sys.exit(main())
