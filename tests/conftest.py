"""Tests use stacks of their own, not one that happens to run on the machine."""

import os

os.environ["GRAZEMAP_LOCAL"] = "own"
