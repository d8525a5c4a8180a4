"""Deprecated name of `grazemap.wire`; version 0.3 removes it."""

import warnings

from grazemap.wire import *  # noqa: F403

warnings.warn("grazemap.models is now grazemap.wire", DeprecationWarning, stacklevel=2)
