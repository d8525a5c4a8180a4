"""The sign rule at grazing: an impact recurs at return m, after m half periods, if ``(-1)^m g(m T/2) < 0``.

Here g is the response of the contact to an impulse and T the forcing period; see equations (33)-(40). With one stop
alone, return m is after m whole periods, and an impact recurs if ``g(m T) < 0``.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats, Integers
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.model.kernels.response_sums import ResponseBlocks
from grazemap_core.model.tolerances import RESPONSE_ROUNDOFF


@njit(cache=True, nogil=True, error_model="numpy")
def first_recurrence(
    blocks: ResponseBlocks, conditioning: float, return_time: Floats, max_order: int, one_stop: bool
) -> Integers:
    """Return for each half period the first return m in 1..max_order at which an impact recurs; 0 if there is none.

    Where g underflows or is smaller than its round-off, as at a codimension-two point of that order, no impact recurs.

    Parameters
    ----------
    blocks : ResponseBlocks
    conditioning : float
        Condition number of the modal model.
    return_time : ndarray of shape (n,)
        Time between two returns.
    max_order : int
    one_stop : bool
        Whether all returns are to one stop, a whole period apart; otherwise they are to both stops in turn.

    Returns
    -------
    ndarray of int, shape (n,)
    """
    decay, discriminant, frequency_squared, value, slope = blocks
    count = decay.size
    result = np.zeros(return_time.size, dtype=np.int64)
    flow = np.empty((count, 4))
    state = np.empty((count, 2))
    for i in range(return_time.size):
        for j in range(count):
            flow[j, 0], flow[j, 1], flow[j, 2], flow[j, 3] = block_flow(
                decay[j], discriminant[j], frequency_squared[j], return_time[i]
            )
            state[j, 0] = value[j]
            state[j, 1] = slope[j]
        orientation = 1.0
        for order in range(1, max_order + 1):
            if not one_stop:
                orientation = -orientation
            total = 0.0
            size = 0.0
            for j in range(count):
                y, rate = state[j, 0], state[j, 1]
                new = flow[j, 0] * y + flow[j, 1] * rate
                new_rate = flow[j, 2] * y + flow[j, 3] * rate
                state[j, 0] = new
                state[j, 1] = new_rate
                total += new
                size += abs(flow[j, 0] * y) + abs(flow[j, 1] * rate) + order * return_time[i] * abs(new_rate)
            # the flow of each step is rounded, so the round-off is proportional to the order
            if orientation * total < -RESPONSE_ROUNDOFF * conditioning * order * size:
                result[i] = order
                break
    return result
