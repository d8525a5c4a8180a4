"""The motion of the oscillator over half a forcing period: contacts, impacts, chatter and sticking.

Time is cut into cells. A bound clears most cells of contacts; in the others the first contact is isolated rigorously,
the impact law is applied, and complete chatter and rest on a stop are followed exactly.

- `cell_problem`: the arrays that the kernels take, from an oscillator and a forcing frequency.
- `held_problem`: the arrays that describe the structure while the contact rests on a stop.
- `kernels.half_period`: a trajectory over half a forcing period.
- `kernels.event_loop`: the impacts of one cell.
- `kernels.first_contact`: the test that a cell has no contact, and the search for the first contact.
- `kernels.sticking`: how the contact comes to rest on a stop and is released.
- `kernels.sticking_flow`: states and flow while it rests.
- `kernels.cells`, `kernels.cell_factors`: flow and series over one cell, and their tables.
- `kernels.runs`: the run of a trajectory, statuses and the record of events.
"""
