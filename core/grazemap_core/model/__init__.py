"""The oscillator and its linear motion between impacts.

The package describes a linear structure with its forces and its contact coordinate, decomposes its free motion into
second-order blocks (the modal model), and computes its steady response and its impulse response.

- `oscillator`: structure, forces, contact row and impact law, from validated parameters.
- `structure`: what the modal model needs to know of a structure.
- `chain`, `matrices`: the two kinds of structure: masses and links, or dense matrices.
- `drive`: harmonic forces, and how they depend on the forcing frequency.
- `own_period`: the period of the forces, and computations at their own frequency.
- `modal`: the modal model, for every kind of damping.
- `damped_blocks`: second-order blocks of a structure whose damping couples its modes.
- `modal_refinement`: refinement of a modal decomposition to a few roundings.
- `harmonic_response`: the steady motion without impacts.
- `response_bounds`: how much its amplitudes can bend over an interval of omega.
- `impulse_response`: the response of the contact coordinate to a unit velocity, and its periodic sums.
- `equilibrium`: the static equilibrium, and the gaps from it.
- `summary`: all linear properties at once.
- `kernels`: block flow, the elements of a structure, its steady response, and sums of impulse responses.
"""
