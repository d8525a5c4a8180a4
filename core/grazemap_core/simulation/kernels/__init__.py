"""Compiled kernels of simulation."""
