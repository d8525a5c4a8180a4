"""Sources that could not be read with their numbers."""

from __future__ import annotations

from grazemap import Client
from paper.page import Section


def not_found(client: Client) -> Section:
    """Return the section; the client is not asked."""
    del client
    section = Section("Not compared")
    section.say(
        "- Abstract and Applied Analysis 2014, 642589, on double grazing periodic motions of two masses between"
        " symmetric rigid stops. The abstract and the first lines could be read; they have no equation and no number."
        " The abstract says that over the clearance a continuous transition leads from a chaotic band to a motion of"
        " period 1. The text with its parameters was not found, so that nothing is compared."
    )
    section.say(
        "- D. J. W. Simpson and I. Ghosh, arXiv:2602.22797: the printed formulas and the example, as said above. A. B."
        " Nordmark 1991 and W. Chin et al. 1994: printed windows of period adding, as said above."
    )
    section.say(
        "- F. Peterka; S. W. Shaw and P. Holmes 1983; S. F. Masri and T. K. Caughey; A. C. J. Luo: no text with"
        " numbers was found. Closed forms of motions with one impact are those of the undamped oscillator above."
    )
    return section
