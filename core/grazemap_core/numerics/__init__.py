"""Numerical methods that do not depend on the oscillator, and the compilation of kernels.

The package finds the first zero of a polynomial in the Bernstein basis without missing one, computes eigenvalues and
solutions of small linear systems in given memory, adds and multiplies unevaluated sums of two doubles, and finds the
maxima of trigonometric polynomials.

- `kernels.banded`: linear systems with a banded matrix.
- `kernels.bernstein`: the first sign change of a polynomial on [0, 1].
- `kernels.dense`: small linear systems.
- `kernels.double_double`: arithmetic with about 32 digits.
- `kernels.eigenvalues`: eigenvalues of a small real matrix.
- `trig_maxima`: the highest maxima of a trigonometric polynomial, also while its coefficients change.
- `jit.compiled`: the decorators of kernels, `kernel`, `fused_kernel`, `inlined` and `fused_inlined`.
- `jit.record_references`: named tuples of arrays passed by reference between kernels.
- `jit.lane_values`: numbers and records that lanes share or have for themselves.
"""
