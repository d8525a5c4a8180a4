"""grazemap: grazing bifurcations of impact oscillators, as a client of the grazemap service."""

from importlib.metadata import version

from grazemap.models import Oscillator

__version__ = version("grazemap")
__all__ = ["Oscillator", "__version__"]
