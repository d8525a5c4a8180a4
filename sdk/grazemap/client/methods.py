"""A method of the clients for each process (computation), made at import. Editors read `methods.pyi`."""

from grazemap.client.blocking import blocking
from grazemap.client.process_methods import METHODS


class AsyncMethods:
    """The methods of processes; a client has `_compute`, which they call."""


for _name, _method in METHODS.items():
    _function = _method.function()
    _function.__module__, _function.__qualname__ = __name__, f"{AsyncMethods.__name__}.{_name}"
    setattr(AsyncMethods, _name, _function)


@blocking(AsyncMethods)
class Methods:  # noqa: D101 - its docstring is made too
    pass
