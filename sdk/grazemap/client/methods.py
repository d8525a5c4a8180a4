"""A method of the asynchronous client for each process (computation) of the service, made at import.

The blocking client's are derived from them (`blocking`). Editors read `methods.pyi`.
"""

from grazemap.client.process_methods import METHODS


class AsyncMethods:
    """The methods of processes."""


for _name, _method in METHODS.items():
    _function = _method.function()
    _function.__module__, _function.__qualname__ = __name__, f"{AsyncMethods.__name__}.{_name}"
    setattr(AsyncMethods, _name, _function)
