"""Exceptions of the core.

Kernels return a status; the layer above them raises these exceptions. Every message may reach a user: it says what is
wrong and what would help, and contains no values other than those that the user gave.

    CoreError
    +- ParameterError          a number or a combination of numbers outside the range of the theory
    |  +- SteadyMotionError    the non-impacting steady motion does not exist or is not unique
    +- ConditioningError       the result exists, but double precision would not resolve it
    +- LinearisationError      the trajectory ends early, or grazes a stop: the linearised flow does not exist
"""

from __future__ import annotations


class CoreError(Exception):
    """Base class of the exceptions of the core."""


class ParameterError(CoreError, ValueError):
    """A parameter lies outside the range that the theory covers.

    Parameters
    ----------
    name : str
        Name of the parameter in the interface.
    message : str
        What is required of the parameter.
    """

    def __init__(self, name: str, message: str) -> None:
        super().__init__(f"{name}: {message}")
        self.name = name
        self.message = message

    def __reduce__(self) -> tuple[type[ParameterError], tuple[str, str]]:
        return type(self), (self.name, self.message)


class SteadyMotionError(ParameterError):
    """There is no unique steady motion without impacts, because of an undamped mode or an exact resonance."""


class ConditioningError(CoreError, ArithmeticError):
    """The decomposition into modes is too ill-conditioned."""


class LinearisationError(CoreError, ArithmeticError):
    """The trajectory ends early, or one of its impacts is a graze, where the flow has no derivative."""
