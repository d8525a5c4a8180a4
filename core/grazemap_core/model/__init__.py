"""The oscillator and its linear motion between impacts.

The package describes the chain of masses, decomposes its free motion into second-order blocks (the modal model), and
computes its steady response to the forcing and the impulse response of mass 1.

- `oscillator`: the chain of masses, its forcing and its impact law, from validated parameters.
- `chain`: masses and links, with the first mass free or linked to a wall.
- `modal`: the modal model, for every kind of damping.
- `link_modes`: second-order blocks of a chain with a damping coefficient for each link.
- `modal_refinement`: refinement of a modal decomposition to a few roundings.
- `harmonic_response`: the steady motion without impacts.
- `impulse_response`: the response of mass 1 to a unit velocity, and its periodic sums.
- `kernels`: block flow, residuals, tridiagonal solver and sums of impulse responses.
"""
