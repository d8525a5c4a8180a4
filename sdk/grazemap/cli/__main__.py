"""`python -m grazemap.cli`."""

import sys

from grazemap.cli import main

sys.exit(main())
