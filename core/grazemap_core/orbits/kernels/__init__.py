"""Compiled kernels of orbits: equations, Newton's method, multipliers, admissibility and verification."""
