"""The parent of the workers: it compiles the kernels once, forks workers, replaces dead ones, and reconciles."""
