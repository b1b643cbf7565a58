"""``python -m imucal_wizard``."""

import sys

from imucal_wizard.cli.main import main

sys.exit(main())
