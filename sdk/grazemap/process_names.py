"""The names of the processes and what they compute; apart from the models of their requests, which take longer to load.

The order is that in which documents, messages and the command line name them.
"""

from __future__ import annotations

SUMMARIES = {
    "structures": "Linear properties",
    "grazing-curves": "Grazing curve",
    "codimension-two-points": "Codimension-two points",
    "discontinuity-mappings": "Discontinuity mapping at a graze",
    "trajectories": "Trajectories",
    "bifurcation-diagrams": "Bifurcation diagram",
    "unfolding-maps": "Unfolding map",
    "unfolding-diagrams": "Unfolding diagram",
    "basins": "Basins of attraction",
    "basin-fractions": "Basin fractions",
    "periodic-orbits": "Periodic orbit",
    "orbit-branches": "Branch of a periodic orbit",
    "bifurcation-curves": "Bifurcation curves",
    "proofs": "Proof",
}
"""The summary of each process by its name."""
