"""Deprecated name of `grazemap.wire`; it goes with version 0.3."""

import warnings

from grazemap.wire import *  # noqa: F403

warnings.warn("grazemap.models is now grazemap.wire", DeprecationWarning, stacklevel=2)
