"""Parameters that the core refuses by their names."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from grazemap_core.errors import ParameterError


@contextmanager
def refused(name: str) -> Iterator[None]:
    """Check that what is done within is refused because of the parameter of this name."""
    with pytest.raises(ParameterError) as caught:
        yield
    assert caught.value.name == name
