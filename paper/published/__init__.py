"""Published numbers of impact oscillators with general stops, computed again: one module per source.

`python -m paper.published` (`make published`) starts a stack on this machine, computes everything over HTTP and
writes docs/published.md with its pictures. What others print, or have coded, is a constant of the module of its source;
every other number on the page is computed.
"""
