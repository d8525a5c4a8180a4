"""The oscillators that many tests have in common."""

from __future__ import annotations

from grazemap_core.model.oscillator import Oscillator

DEFAULT = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.8)
"""The chain of three masses that clients have unless they describe another one."""
