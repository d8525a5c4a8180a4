"""Draw the machines of docs/machines.md: `python -m tools.guide.drawings` writes docs/pictures/machine_*.svg.

Every drawing is of one row of masses, springs and dampers, with the ground on the left. Lines and texts have the colour
of the reader's theme, light or dark.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from html import escape
from pathlib import Path

FOLDER = Path(__file__).parents[2] / "docs" / "pictures"
WIDTH, HEIGHT = 660, 236
AXIS = 152  # height of the masses' middle
STYLE = """
  :root { color: #1f2328; }
  .line { fill: none; stroke: currentColor; stroke-width: 1.8; stroke-linecap: round; stroke-linejoin: round; }
  .thin { fill: none; stroke: currentColor; stroke-width: 1; }
  .mass { fill: #9aa7b4; fill-opacity: 0.28; fill-rule: evenodd; stroke: currentColor; stroke-width: 1.8; }
  .stop { fill: #d1495b; fill-opacity: 0.85; stroke: none; }
  .drive { fill: none; stroke: #2f7fd6; stroke-width: 2.2; }
  .head { fill: #2f7fd6; }
  .tip { fill: currentColor; }
  text { font: italic 16px Georgia, 'Times New Roman', serif; fill: currentColor; text-anchor: middle; }
  .plain { font: 13px sans-serif; }
  .driven { fill: #2f7fd6; }
  @media (prefers-color-scheme: dark) {
    :root { color: #e6edf3; }
    .drive { stroke: #6cb0ff; } .head, .driven { fill: #6cb0ff; } .stop { fill: #ff7b8a; }
  }
"""

Parts = Iterator[str]


def drawing(title: str, parts: Callable[[], Parts]) -> str:
    """Return the text of a picture."""
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}"'
            ' role="img">',
            f"<title>{escape(title)}</title>",
            f"<style>{STYLE}</style>",
            *parts(),
            "</svg>\n",
        ]
    )


def path(points: str, kind: str = "line") -> str:
    """Return a path."""
    return f'<path class="{kind}" d="{points}"/>'


def text(x: float, y: float, written: str, kind: str = "") -> str:
    """Return a text; `_` in it starts an index of one letter."""
    parts = written.split("_")
    shown = escape(parts[0])
    for part in parts[1:]:
        shown += f'<tspan dy="4" font-size="11">{escape(part[0])}</tspan>'
        shown += f'<tspan dy="-4">{escape(part[1:])}</tspan>' if part[1:] else ""
    return f'<text x="{x:g}" y="{y:g}" class="{kind}">{shown}</text>'


def wall(x: float, top: float = AXIS - 48, bottom: float = AXIS + 48) -> Parts:
    """Draw the ground as a wall, with hatches on its left."""
    yield path(f"M{x:g} {top:g}V{bottom:g}")
    for y in range(int(top) + 8, int(bottom) + 6, 10):
        yield path(f"M{x:g} {y - 8:g}l-9 9", "thin")


def ceiling(left: float, right: float, y: float = 34) -> Parts:
    """Draw the ground as a ceiling, with hatches above."""
    yield path(f"M{left:g} {y:g}H{right:g}")
    for x in range(int(left), int(right) - 4, 10):
        yield path(f"M{x:g} {y:g}l9 -9", "thin")


def spring(left: float, right: float, y: float, name: str = "") -> Parts:
    """Draw a spring."""
    lead, turns = 10.0, 5
    step = (right - left - 2 * lead) / (4 * turns)
    turn = f"l{step:g} -8l{2 * step:g} 16l{step:g} -8"
    yield path(f"M{left:g} {y:g}h{lead:g}{turn * turns}h{lead:g}")
    if name:
        yield text((left + right) / 2, y - 15, name)


def damper(left: float, right: float, y: float, name: str = "") -> Parts:
    """Draw a damper."""
    middle = (left + right) / 2
    yield path(f"M{left:g} {y:g}H{middle - 11:g}M{middle + 13:g} {y - 9:g}h-24v18h24M{middle + 3:g} {y - 6:g}v12")
    yield path(f"M{middle + 3:g} {y:g}H{right:g}")
    if name:
        yield text(middle, y + 26, name)


def link(left: float, right: float, stiffness: str, damping: str) -> Parts:
    """Draw a spring above a damper."""
    yield from spring(left, right, AXIS - 18, stiffness)
    yield from damper(left, right, AXIS + 18, damping)


def mass(left: float, right: float, name: str, height: float = 80) -> Parts:
    """Draw a mass."""
    place = f'x="{left:g}" y="{AXIS - height / 2:g}" width="{right - left:g}" height="{height:g}"'
    yield f'<rect class="mass" {place} rx="3"/>'
    yield text((left + right) / 2, AXIS + 6, name)


def peg(x: float, foot: float) -> Parts:
    """Draw the part of a mass that meets the stops."""
    yield path(f"M{x:g} {foot:g}V62", "line")
    yield f'<circle class="tip" cx="{x:g}" cy="62" r="5"/>'


def stop(x: float, side: int, top: float = 34) -> Parts:
    """Draw a stop that hangs from the ceiling; it is hit from the left (side 1) or from the right (-1)."""
    left = x if side > 0 else x - 12
    yield f'<rect class="stop" x="{left:g}" y="{top:g}" width="12" height="42"/>'


def distance(left: float, right: float, y: float, name: str) -> Parts:
    """Draw a distance with its name below."""
    yield path(f"M{left:g} {y - 5:g}v10M{right:g} {y - 5:g}v10M{left:g} {y:g}H{right:g}", "thin")
    yield text((left + right) / 2, y + 17, name)


def force(x: float, y: float, name: str, length: float = 46) -> Parts:
    """Draw a force."""
    yield path(f"M{x:g} {y:g}h{length - 8:g}", "drive")
    yield f'<path class="head" d="M{x + length:g} {y:g}l-10 -5v10z"/>'
    yield text(x + length + 6 + 4 * len(name), y + 5, name, "driven")


def swing(x: float, y: float, name: str) -> Parts:
    """Draw a motion back and forth."""
    yield path(f"M{x - 22:g} {y:g}h44", "drive")
    yield f'<path class="head" d="M{x + 30:g} {y:g}l-10 -5v10z"/><path class="head" d="M{x - 30:g} {y:g}l10 -5v10z"/>'
    yield text(x + 34 + 4 * len(name), y + 5, name, "driven")


def one_stop() -> Parts:
    """Draw a mass on a spring, in front of one stop."""
    yield from wall(70)
    yield from link(70, 210, "k", "c")
    yield from mass(210, 330, "m")
    yield from ceiling(300, 440)
    yield from peg(300, AXIS - 40)
    yield from stop(372, 1)
    yield from distance(300, 372, 86, "c_R")
    yield from force(330, AXIS, "F sin ωt")


def two_stops() -> Parts:
    """Draw two masses, the first one between two stops, with a static force."""
    yield from wall(40)
    yield from link(40, 150, "k_2", "c_2")
    yield from mass(150, 240, "m_2")
    yield from link(240, 350, "k_1", "c_1")
    yield from mass(350, 450, "m_1")
    yield from ceiling(315, 520)
    yield from peg(400, AXIS - 40)
    yield from stop(352, -1)
    yield from stop(478, 1)
    yield from distance(352, 400, 86, "c_L")
    yield from distance(400, 478, 86, "c_R")
    yield from force(450, AXIS - 16, "F sin ωt")
    yield from force(450, AXIS + 22, "s")


def block_in_box() -> Parts:
    """Draw a block between two stops in a box."""
    yield from wall(50)
    yield from link(50, 170, "k_2", "c_2")
    outer, inner = (f"M{170 + d} {AXIS - 104 + d}H{510 - d}V{AXIS + 68 - d}H{170 + d}Z" for d in (0, 14))
    yield path(outer + inner, "mass")
    yield from link(184, 290, "k_1", "c_1")
    yield f'<rect class="mass" x="290" y="{AXIS - 76}" width="100" height="122" rx="3"/>'
    yield text(536, AXIS - 80, "m_2")
    for x, left, right in ((184, 196, 290), (484, 390, 484)):
        yield f'<rect class="stop" x="{x}" y="{AXIS - 76}" width="12" height="24"/>'
        yield from distance(left, right, AXIS - 64, "")
        yield text((left + right) / 2, AXIS - 70, "c")


def impact_damper() -> Parts:
    """Draw a block in a box that is forced."""
    yield from block_in_box()
    yield text(340, AXIS - 8, "m_1")
    yield from force(510, AXIS, "F sin ωt")


def unbalanced_rotor() -> Parts:
    """Draw a rotor in its housing."""
    yield from block_in_box()
    yield f'<circle class="mass" cx="340" cy="{AXIS - 24}" r="34"/>'
    yield text(340, AXIS + 34, "m_1")
    yield path(f"M340 {AXIS - 24}l18 -14", "thin")
    yield f'<circle class="head" cx="358" cy="{AXIS - 38}" r="5"/>'
    yield text(344, AXIS - 36, "e")
    yield path(f"M314 {AXIS - 14}a28 28 0 0 0 44 8", "drive")
    yield f'<path class="head" d="M364 {AXIS - 14}l-10 4l7 8z"/>'
    yield text(335, AXIS - 8, "ω", "driven")


def shaken_base() -> Parts:
    """Draw three masses on a ground that moves, with the stops."""
    yield path(f"M26 {AXIS + 60}V20H580V34H40V{AXIS + 60}Z", "mass")
    for left, name in ((40, "3"), (190, "2"), (340, "1")):
        yield from link(left, left + 80, f"k_{name}", f"c_{name}")
        yield from mass(left + 80, left + 150, f"m_{name}")
    yield from peg(455, AXIS - 40)
    yield from stop(405, -1)
    yield from stop(505, 1)
    yield from distance(405, 455, 86, "c")
    yield from distance(455, 505, 86, "c")
    yield from swing(80, AXIS + 70, "y = Y sin ωt")


DRAWINGS: dict[str, tuple[str, Callable[[], Parts]]] = {
    "one_stop": ("A mass on a spring and a damper, in front of one stop", one_stop),
    "two_stops": ("Two masses, of which the first one moves between two unlike stops", two_stops),
    "impact_damper": ("A block in a box that is forced", impact_damper),
    "unbalanced_rotor": ("An unbalanced rotor between stops of its housing", unbalanced_rotor),
    "shaken_base": ("Three masses on a base that is shaken, with stops on the base", shaken_base),
}


def main() -> None:
    """Write all drawings."""
    for name, (title, parts) in DRAWINGS.items():
        (FOLDER / f"machine_{name}.svg").write_text(drawing(title, parts), "utf-8")


if __name__ == "__main__":
    main()
