"""Motions with one impact in n forcing periods on a stop, or one on each stop: explicit in the phase of the impact.

In the order in which they build on each other:

`harmonics` : trigonometric polynomials of the phase, and their zeros.
`orbits` : speed and gap as functions of the phase; saddle-nodes, period doublings, orbits of a given gap.
`special_orbits` : whether orbits meet a stop a second time, and where that begins.
`curves` : special orbits at successive frequencies, joined to curves.
`fixed_stop_curves` : curves where the stop of the impact is fixed, and the other one varies.
`curve_parameter` : the clearance, or the factor of the forces or of the bias, that belongs to a gap.
`curve_ends` : where pieces of curves in a window end, between two frequencies.
`window_curves` : the curves inside a window, cut into pieces.
"""
