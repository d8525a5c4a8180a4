"""Kernels that are not stored yet are compiled in three quarters of the time."""

from grazemap_core.numerics.jit.quick_compiler import hurry

hurry()
