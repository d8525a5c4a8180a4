"""What the paper prints, with its place there: the only numbers of the page that are not computed."""

from __future__ import annotations

from dataclasses import dataclass

from grazemap import Oscillator
from grazemap.wire import motion_label

TITLE = "Codimension-Two Grazing Bifurcations in Three-Degree-of-Freedom Impact Oscillator with Symmetrical Constraints"

# "k_2 = k_3 = 5, m_2 = m_3 = 10, zeta_i = 0.05, R = 0.8, f_10 = 1, f_20 = f_30 = 0", the same for all its figures. The
# damping is read in two ways: gamma = 0.05 for the chain, C = 2 gamma K; or zeta_i = 0.05 in each link of (3).
MASSES, STIFFNESSES, ZETA, RESTITUTION = [1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, 0.8
GAMMA, PER_LINK = "gamma = 0.05", "zeta_i = 0.05 per link"


def _chain(damping: float | list[float]) -> Oscillator:
    return Oscillator(
        masses=MASSES, stiffnesses=STIFFNESSES, damping=damping, forcing=[1.0, 0.0, 0.0], restitution=RESTITUTION
    )


READINGS = {GAMMA: _chain(ZETA), PER_LINK: _chain([ZETA] * 3)}


@dataclass(frozen=True)
class Printed:
    """A printed number: its digits as text, what it is, and where it stands."""

    text: str
    what: str
    where: str

    @property
    def value(self) -> float:
        """The number."""
        return float(self.text)

    def agrees(self, computed: float) -> bool:
        """Whether the computed number rounds to the printed one."""
        return f"{computed:.{len(self.text.partition('.')[2])}f}" == self.text


GRAZING_OMEGA = 0.1
GRAZING_CLEARANCE = Printed("1.44159", "clearance of the double grazing motion at omega = 0.1", "Section 2.2, Figure 3")
POINT_OMEGA = Printed("0.28109", "omega of a point with xi_1 = 0", "Section 5, Figures 5, 6, 8")
POINT_CLEARANCE = Printed("1.92036", "b of that point", "Section 5, Figures 5, 6, 8")


@dataclass(frozen=True)
class Region:
    """A region of Figure 9: its letter and n-p_r-q_l as printed; None for "multi"."""

    letter: str
    n: int | None
    right: int | None
    left: int | None

    @property
    def label(self) -> str:
        """The printed label."""
        if self.n is None:
            right, left = ("multi" if impacts is None else impacts for impacts in (self.right, self.left))
            return f"multi-{right}r-{left}l"
        return motion_label(self.n, self.right or 0, self.left or 0)


# Section 5: "Decreasing b from 2.0 to 1.494 ... 1.86 to 1.34", and the labels of Figure 9 (a)-(k), (l)-(v).
REGIONS = {
    0.29: (
        (2.0, 1.494),
        [
            Region("a", 1, -1, -1), Region("b", None, 0, 0), Region("c", 1, 1, -1), Region("d", 1, -1, 1),
            Region("e", 1, 1, 1), Region("f", 2, 1, 1), Region("g", None, None, None), Region("h", 2, 2, 2),
            Region("i", 3, 2, 2), Region("j", 3, 3, 3), Region("k", 4, 3, 3),
        ],
    ),
    0.27: (
        (1.86, 1.34),
        [
            Region("l", 1, 1, -1), Region("m", 3, -1, 3), Region("n", 1, 1, 1), Region("o", 2, 1, 1),
            Region("p", 6, 4, 4), Region("q", 10, 8, 8), Region("r", None, None, None), Region("s", 2, 2, 2),
            Region("t", 3, 2, 2), Region("u", 3, 3, 3), Region("v", 4, 4, 4),
        ],
    ),
}  # fmt: skip
