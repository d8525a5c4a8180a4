"""Proofs in ball arithmetic: the search for certificates, which the checker in `grazemap.checker` verifies.

`prove` : search for the proof, or the disproof, of a statement.
`certificates` : exact inputs and the parts of a certificate, and solutions with many digits.
`orbits`, `attraction`, `bifurcations` : the theorems.
`simulation` : trajectories with many digits.
"""
