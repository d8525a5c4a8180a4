"""The motion of the oscillator over half a forcing period: contacts, impacts, chatter and sticking.

Time is cut into cells. A bound clears most cells of contacts; in the others the first contact is isolated rigorously,
the impact law is applied, and complete chatter and rest on a stop are followed exactly.

- `forced`: a structure under its forces at one frequency, and the arrays that the kernels take of it.
- `trajectory_models`: its modal models with the contact free and at rest.
- `reference_motion`: the motion that states are relative to.
- `stops`: the stops, from the clearances that users give.
- `kernels.half_period`: a trajectory over half a forcing period, and through the impacts of one cell.
- `kernels.first_contact`: the test that a cell has no contact, and the search for the first contact.
- `kernels.sticking`: how the contact comes to rest on a stop and is released, and the motion in between.
- `kernels.cells`, `kernels.cell_factors`: flow and series over one cell, and their tables.
- `kernels.runs`: the run of a trajectory, statuses and the record of events.
"""
