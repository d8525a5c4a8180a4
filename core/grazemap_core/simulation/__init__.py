"""Trajectories and the motions to which they settle.

The package follows trajectories with a record of every impact, detects the period of the motion, and computes monodromy
matrices and Lyapunov exponents from the linearised flow.

- `start`: validated initial states, and the arrays of a trajectory.
- `trajectories`: recorded trajectories, with samples and the motion that they settle to.
- `record`: impacts, intervals of sticking and samples of a recorded trajectory.
- `motion`: the name of a motion, and the reasons why it may be unresolved.
- `monodromy`: a trajectory with the linearised flow along it, the monodromy matrix and its Floquet multipliers.
- `observables`: impact rates and speeds, impulse, dissipated power, and outputs of a motion.
- `multiprecision`, `multiprecision_modes`: trajectories in multi-precision arithmetic.
- `kernels`: recorded runs and samples, period detection, tangent flow and exponents, outputs.
"""
