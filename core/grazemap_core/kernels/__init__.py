"""Compiled kernels: arrays in, values and a status out; they never raise."""
