"""The supervisor of the workers: has kernels compiled, forks workers and replaces dead ones, and reconciles."""
