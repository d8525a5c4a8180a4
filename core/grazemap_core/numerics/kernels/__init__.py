"""Compiled kernels of numerics."""
