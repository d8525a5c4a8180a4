"""What the core refuses, and in which words.

Kernels return a status; the layer above them raises from here. The text of every error may reach a user, so it
says what is wrong and what would help, and holds no values beyond those that the user gave.

    CoreError
    +- ParameterError          a number or a combination of numbers outside what the theory covers
    |  +- SteadyMotionError    the non-impacting steady motion does not exist or is not unique
    +- ConditioningError       the answer exists, but double precision would not return its digits
    +- LinearisationError      the trajectory ends, or grazes a stop, where its linearised flow was wanted
"""

from __future__ import annotations


class CoreError(Exception):
    """Base of everything that the core raises on purpose."""


class ParameterError(CoreError, ValueError):
    """A parameter lies outside the range that the theory covers.

    Parameters
    ----------
    name : str
        The parameter, as the interface calls it.
    message : str
        What was expected of it.
    """

    def __init__(self, name: str, message: str) -> None:
        super().__init__(f"{name}: {message}")
        self.name = name
        self.message = message

    def __reduce__(self) -> tuple[type[ParameterError], tuple[str, str]]:
        return type(self), (self.name, self.message)


class SteadyMotionError(ParameterError):
    """An undamped mode or an exact resonance leaves no unique steady motion without impacts; names the parameter."""


class ConditioningError(CoreError, ArithmeticError):
    """The decomposition into modes would lose more digits than the core promises to keep."""


class LinearisationError(CoreError, ArithmeticError):
    """The trajectory ends early, or an impact on it is a graze, at which the flow has no derivative."""
