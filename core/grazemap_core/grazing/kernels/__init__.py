"""Compiled kernels of grazing."""
