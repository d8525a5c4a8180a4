"""Long checks of general systems: `python -m general_checks [NAME ...]` (`make general`).

Each module has `check(share, processes)`, which prints its figures on the way and returns the rows of the table at the
end. `share` is the environment's SHARE, 1 unless it is set: the part of the cases that are computed. Cases follow from
seeds, so a smaller share computes the first of them.
"""
