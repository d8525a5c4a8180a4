"""Proofs in ball arithmetic: the search for certificates, which the checker in `grazemap.checker` verifies.

`prove` : search for the proof, or the disproof, of a statement.
`certificates` : exact inputs and the parts of a certificate.
`refinement` : solutions with many digits from double-precision ones.
`orbits`, `attraction`, `bifurcations`, `codimension_two` : the theorems.
`simulation` : trajectories with many digits.
"""
