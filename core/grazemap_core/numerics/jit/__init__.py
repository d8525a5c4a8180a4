"""Compilation of kernels with numba."""
