"""The oscillator and its linear motion between impacts.

The package describes a linear structure with its forces and its contact coordinate, decomposes its free motion into
second-order blocks (the modal model), and computes its steady response and its impulse response.

What a structure is:

- `structure`: what the other modules need to know of one.
- `chain`, `matrices`: the two kinds of structure: masses and links, or dense matrices.
- `kernels.elements`: a structure as a sum of elements, and the residual of its decomposition.
- `held_structure`: the structure while its contact rests on a stop.

What a user gives:

- `oscillator`: structure, forces, contact row and impact law, from validated parameters.
- `drive`: harmonic forces, and how they depend on the forcing frequency.
- `own_period`: the period of the forces, and computations at their own frequency.
- `equilibrium`: the static equilibrium, and the gaps from it.
- `summary`: all linear properties at once.

The free motion, in second-order blocks:

- `modal`: the modal model, for every kind of damping.
- `damped_blocks`: blocks of a structure whose damping couples its modes.
- `modal_refinement`: refinement of a decomposition to a few roundings.
- `kernels.block_flow`: the motion of a block, free and forced.

The response to forces and impulses:

- `harmonic_response`: the steady motion without impacts, resonant modes, and bounds over an interval of omega.
- `kernels.steady_response`: its linear system, solved to round-off.
- `impulse_response`: the response of the contact coordinate to a unit velocity.
- `kernels.response_sums`: its periodic sums, with bounds.
"""
