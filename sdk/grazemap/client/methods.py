"""The methods of the clients, one for each process; editors read `methods.pyi`."""

from grazemap.client.process_methods import METHODS


class AsyncMethods:
    """The methods of processes."""


for _name, _method in METHODS.items():
    _function = _method.function()
    _function.__module__, _function.__qualname__ = __name__, f"{AsyncMethods.__name__}.{_name}"
    setattr(AsyncMethods, _name, _function)
