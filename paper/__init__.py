"""The paper, reproduced through the service: one module per group of figures, each a function from client to Section.

`python -m paper` (`make reproduce`) starts a stack on this machine, computes everything over HTTP and
writes docs/reproduction.md with its pictures. Whatever the paper prints is a constant of `paper.py`; every other number
on the page is computed.
"""
