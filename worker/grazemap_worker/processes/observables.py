"""What requests read off motions: from the request to the core, and from its figures to the document."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from grazemap.codec import Document
from grazemap.results.documents import document_of
from grazemap.results.observables import MEANS as FIGURES
from grazemap.results.observables import Output
from grazemap.wire.observables import ObservedRequest

if TYPE_CHECKING:
    from grazemap_core.simulation.observables import Observables

MEANS = tuple(one.name for one in FIGURES)
OUTPUTS = "outputs"


def core_observables(request: ObservedRequest) -> Observables | None:
    """Return what a request reads off motions, None where that is nothing."""
    from grazemap_core.simulation.observables import Observables
    from grazemap_core.simulation.observables import Output as CoreOutput

    if not request.observed:
        return None
    nothing = [0.0] * request.oscillator.size
    outputs = [
        CoreOutput(name, np.array(one.displacement or nothing), np.array(one.velocity or nothing))
        for name, one in request.outputs.items()
    ]
    return Observables(tuple(request.observables), tuple(outputs))


def observed_document(request: ObservedRequest, figures: NDArray[np.float64] | None) -> Document:
    """Return the fields of observables and outputs from figures (count, ...) of the core."""
    if figures is None or not request.observed:
        return {}
    values = [float(one) for one in figures] if figures.ndim == 1 else list(figures)
    document: Document = dict(zip(request.observables, values, strict=False))
    if request.outputs:
        of_outputs = values[len(request.observables) :]
        document[OUTPUTS] = [
            document_of(
                Output,
                name=name,
                unit=one.unit,
                **dict(zip(MEANS, of_outputs[len(MEANS) * k : len(MEANS) * (k + 1)], strict=True)),
            )
            for k, (name, one) in enumerate(request.outputs.items())
        ]
    return document
