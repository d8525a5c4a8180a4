"""Compiled kernels of maps: trajectories in lockstep, and their classification."""
