"""Observables and outputs: conversion of a request for the core, and of the core's figures into a document."""

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

MEANS = tuple(figure.name for figure in FIGURES)
OUTPUTS = "outputs"


def core_observables(request: ObservedRequest) -> Observables | None:
    """Return the observables and outputs of a request as an object of the core; None if it has none."""
    from grazemap_core.simulation.observables import Observables
    from grazemap_core.simulation.observables import Output as CoreOutput

    if not request.observed:
        return None
    zeros = [0.0] * request.oscillator.size
    outputs = [
        CoreOutput(name, np.array(output.displacement or zeros), np.array(output.velocity or zeros))
        for name, output in request.outputs.items()
    ]
    return Observables(tuple(request.observables), tuple(outputs))


def observed_document(request: ObservedRequest, figures: NDArray[np.float64] | None) -> Document:
    """Return the fields of observables and outputs, from the figures (count, ...) of the core."""
    if figures is None or not request.observed:
        return {}
    values = [float(figure) for figure in figures] if figures.ndim == 1 else list(figures)
    document: Document = dict(zip(request.observables, values, strict=False))
    if request.outputs:
        means = values[len(request.observables) :]
        document[OUTPUTS] = [
            document_of(
                Output,
                name=name,
                unit=output.unit,
                **dict(zip(MEANS, means[len(MEANS) * k : len(MEANS) * (k + 1)], strict=True)),
            )
            for k, (name, output) in enumerate(request.outputs.items())
        ]
    return document
