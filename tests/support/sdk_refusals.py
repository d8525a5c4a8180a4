"""What the client refuses before anything is sent."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from grazemap.errors import ParameterError


def refused(call: Callable[..., Any], *arguments: Any, **keywords: Any) -> dict[str, tuple[str, str]]:
    """Return what is wrong and what is allowed by the pointers of a call that must be refused."""
    with pytest.raises(ParameterError) as caught:
        call(*arguments, **keywords)
    assert caught.value.status == 422
    assert caught.value.request_id is None
    assert isinstance(caught.value, ValueError)
    return {error.pointer: (error.detail, error.allowed) for error in caught.value.problem.errors}
