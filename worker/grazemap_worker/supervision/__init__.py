"""The parent of the workers: it has the kernels compiled, forks workers, replaces dead ones, and reconciles."""
