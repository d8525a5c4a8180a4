"""Compiled kernels of contact."""
