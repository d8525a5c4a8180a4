"""Compiled kernels of model."""
