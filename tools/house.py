"""The picture of the house, drawn from the imports.

`python -m tools.house` (`make house`) writes docs/pictures/house.svg; with `--check` it only says whether the picture
is stale. A room is a folder of one of the four packages, or a module that stands beside the folders. A room stands one
floor above the highest room that it imports. Rooms that import each other have a red outline. The picture has no
counts: it changes only when a room or a direction between rooms does.
"""

from __future__ import annotations

import argparse
import sys
import textwrap
from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from typing import NamedTuple

import grimp

ROOT = Path(__file__).parents[1]
PICTURE = ROOT / "docs" / "pictures" / "house.svg"
SERVICE, WORKER, CORE, SDK = "grazemap_service", "grazemap_worker", "grazemap_core", "grazemap"
# what everything else in the core may import, and what the text of a room leaves out
FOUNDATION = {"arrays", "checks", "codes", "compiled_ahead", "errors", "kernel_folder", "tolerances"}

# imports that have no arrow: the search for certificates uses the equations of the checker, which works without it
ASIDE = {(CORE, SDK): {"checker"}}

MARGIN, GAP, PADDING, CAPTION_HEIGHT = 20, 8, 12, 26
FOLDER_HEIGHT, MODULE_HEIGHT, TITLE_HEIGHT, BETWEEN = 46, 24, 30, 74
LETTER, SMALL_LETTER = 8.0, 6.1
WIDTH = 1240
CAPTION = (
    "Blue: folders. White: modules. Each imports only what stands on lower floors, and packages along the arrows;"
    " proofs imports the checker too."
)


class Room(NamedTuple):
    """A folder or a module of a package, and the rooms of the same package that it imports."""

    package: str
    name: str
    is_folder: bool
    imports: frozenset[str]


class House(NamedTuple):
    """The rooms of all packages, and for each pair of packages the rooms of the second that the first imports."""

    rooms: dict[str, dict[str, Room]]
    between: dict[tuple[str, str], frozenset[str]]


class Frame(NamedTuple):
    """Where a package is drawn."""

    left: float
    top: float
    width: float
    height: float


def read() -> House:
    """Return the rooms of the packages on the path, from their imports; those for type checkers only do not count."""
    graph = grimp.build_graph(SDK, CORE, WORKER, SERVICE, exclude_type_checking_imports=True)
    folders = {tuple(name.split(".")[:2]) for name in graph.modules if name.count(".") > 1}
    within: dict[tuple[str, str], set[str]] = {}
    between: dict[tuple[str, str], set[str]] = {}
    for module in sorted(graph.modules):
        package, *inner = module.split(".")
        if not inner:
            continue
        imported = within.setdefault((package, inner[0]), set())
        for target in graph.find_modules_directly_imported_by(module):
            other, *target_inner = target.split(".")
            if other != package:
                between.setdefault((package, other), set()).update(target_inner[:1])
            elif target_inner and target_inner[0] != inner[0]:
                imported.add(target_inner[0])
    rooms: dict[str, dict[str, Room]] = {package: {} for package in (SERVICE, WORKER, CORE, SDK)}
    for (package, name), imports in sorted(within.items()):
        rooms[package][name] = Room(package, name, (package, name) in folders, frozenset(imports))
    return House(rooms, {pair: frozenset(names) for pair, names in between.items()})


def floors(rooms: dict[str, Room]) -> list[list[Room]]:
    """Return the rooms of one package floor by floor, the lowest first; rooms in a circle share a floor."""
    reach = {name: _reachable(rooms, name) for name in rooms}
    height: dict[str, int] = {}

    def floor(name: str) -> int:
        if name not in height:
            circle = {other for other in reach[name] if name in reach[other]} | {name}
            below = {target for member in circle for target in rooms[member].imports} - circle
            here = 1 + max((floor(target) for target in below), default=-1)
            height.update(dict.fromkeys(circle, here))
        return height[name]

    stacked: list[list[Room]] = [[] for _ in range(1 + max(map(floor, rooms)))]
    for name in sorted(rooms):
        stacked[height[name]].append(rooms[name])
    return stacked


def circles(rooms: dict[str, Room]) -> set[str]:
    """Return the names of the rooms that import each other, directly or not."""
    return {name for name in rooms if name in _reachable(rooms, name)}


def draw(house: House) -> str:
    """Return the picture as SVG: the service above the worker, both above the core and the SDK."""
    stacked = {package: floors(rooms) for package, rooms in house.rooms.items()}
    inner = WIDTH - 2 * MARGIN
    widths = {SERVICE: inner, WORKER: 0.72 * inner, CORE: 0.48 * inner, SDK: 0.48 * inner}
    lefts = {SERVICE: MARGIN, WORKER: MARGIN, CORE: MARGIN, SDK: MARGIN + inner - widths[SDK]}
    rows = {package: [_lines(floor, widths[package]) for floor in stacked[package]] for package in stacked}
    heights = {package: TITLE_HEIGHT + PADDING + sum(map(_height, rows[package])) for package in stacked}
    tops = {SERVICE: float(MARGIN + CAPTION_HEIGHT)}
    tops[WORKER] = tops[SERVICE] + heights[SERVICE] + BETWEEN
    tops[CORE] = tops[SDK] = tops[WORKER] + heights[WORKER] + BETWEEN
    frames = {package: Frame(lefts[package], tops[package], widths[package], heights[package]) for package in stacked}
    total = tops[CORE] + max(heights[CORE], heights[SDK]) + MARGIN
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{total:.0f}"'
        f' viewBox="0 0 {WIDTH} {total:.0f}" font-family="sans-serif">',
        '<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" orient="auto">'
        '<path d="M0 0 L8 4 L0 8 z" fill="#555"/></marker></defs>',
        f'<rect width="{WIDTH}" height="{total:.0f}" fill="white"/>',
    ]
    parts.append(_label(MARGIN, MARGIN + 10, CAPTION, size=13))
    for package, frame in frames.items():
        parts += _frame(package, frame, rows[package], circles(house.rooms[package]))
    parts += _arrows(house, frames)
    return "\n".join([*parts, "</svg>\n"])


def _reachable(rooms: dict[str, Room], start: str) -> set[str]:
    """Return the rooms that one imports, directly or not; itself too where it stands in a circle."""
    seen: set[str] = set()
    pending = list(rooms[start].imports)
    while pending:
        name = pending.pop()
        if name not in seen:
            seen.add(name)
            pending += rooms[name].imports
    return seen


def _text(room: Room) -> str:
    """Return what is written below a folder's name."""
    names = sorted(room.imports - (FOUNDATION if room.package == CORE else set()))
    return f"imports {', '.join(names)}" if names else ""


def _room_width(room: Room) -> float:
    """Return the minimum width in which a module's name is legible; folders share what is left of a line."""
    return len(room.name) * LETTER + 2 * GAP if not room.is_folder else 170.0


def _lines(floor: Sequence[Room], width: float) -> list[list[Room]]:
    """Return the rooms of a floor in lines that fit into the width, folders first."""
    lines: list[list[Room]] = []
    for kind in (True, False):
        free = 0.0
        for room in (room for room in floor if room.is_folder is kind):
            need = _room_width(room) + GAP
            if need > free:
                lines.append([])
                free = width - 2 * PADDING
            lines[-1].append(room)
            free -= need
    return lines


def _height(lines: Sequence[Sequence[Room]]) -> float:
    """Return the height of a floor with the gap above the next one."""
    return sum((FOLDER_HEIGHT if line[0].is_folder else MODULE_HEIGHT) + 4 for line in lines) + GAP


def _frame(package: str, frame: Frame, rows: Sequence[Sequence[Sequence[Room]]], red: set[str]) -> Iterator[str]:
    """Yield a package: its frame and its rooms, the lowest floor at the bottom."""
    left, top, width, height = frame
    yield f'<rect x="{left:.0f}" y="{top:.0f}" width="{width:.0f}" height="{height:.0f}" fill="#f4f4f4" stroke="#888"/>'
    yield _label(left + PADDING, top + 20, package, size=15, weight="bold")
    y = top + TITLE_HEIGHT
    for lines in reversed(rows):
        inner = _height(lines) - GAP
        yield (
            f'<rect x="{left + 4:.0f}" y="{y:.0f}" width="{width - 8:.0f}" height="{inner + 4:.0f}" fill="#e6eaf0"/>'
        )
        line_top = y + 4
        for line in lines:
            tall = FOLDER_HEIGHT if line[0].is_folder else MODULE_HEIGHT
            x = left + PADDING
            share = (width - 2 * PADDING + GAP) / len(line) - GAP
            for room in line:
                wide = share if room.is_folder else _room_width(room)
                yield from _room(room, Frame(x, line_top, wide, tall), room.name in red)
                x += wide + GAP
            line_top += tall + 4
        y += _height(lines)


def _room(room: Room, frame: Frame, in_circle: bool) -> Iterator[str]:
    """Yield a room: its name, and below a folder's name what it imports."""
    fill = "#cfe0f5" if room.is_folder else "white"
    stroke = 'stroke="#c00" stroke-width="2"' if in_circle else 'stroke="#667"'
    yield (
        f'<rect x="{frame.left:.0f}" y="{frame.top:.0f}" width="{frame.width:.0f}" height="{frame.height:.0f}" rx="3"'
        f' fill="{fill}" {stroke}/>'
    )
    yield _label(frame.left + GAP, frame.top + 16, room.name, size=13, weight="bold" if room.is_folder else "normal")
    if room.is_folder:
        lines = textwrap.wrap(_text(room), max(10, int((frame.width - 2 * GAP) / SMALL_LETTER)))
        for i, line in enumerate(lines[:2]):
            last = line if i == 0 or len(lines) <= 2 else line + " …"
            yield _label(frame.left + GAP, frame.top + 29 + 12 * i, last, size=11, colour="#445")


def _arrows(house: House, frames: dict[str, Frame]) -> Iterator[str]:
    """Yield an arrow for each pair of packages, with the rooms that are imported along it."""
    places = {
        (SERVICE, WORKER): frames[WORKER].left + 0.1 * frames[WORKER].width,
        (SERVICE, SDK): frames[WORKER].left + frames[WORKER].width + 40,
        (WORKER, CORE): frames[CORE].left + 0.1 * frames[CORE].width,
        (WORKER, SDK): frames[SDK].left + 30,
    }
    with_arrow = {pair for pair, names in house.between.items() if not names <= ASIDE.get(pair, set())}
    unknown = with_arrow - set(places)
    if unknown:
        raise ValueError(f"imports against the direction of the house: {sorted(unknown)}")
    for (above, below), x in places.items():
        names = ", ".join(sorted(house.between.get((above, below), ())))
        start = frames[above].top + frames[above].height
        yield (
            f'<line x1="{x:.0f}" y1="{start:.0f}" x2="{x:.0f}" y2="{frames[below].top - 1:.0f}" stroke="#555"'
            ' stroke-width="2" marker-end="url(#head)"/>'
        )
        room = (WIDTH - MARGIN if below in (SDK, WORKER) else frames[SDK].left) - x - 20
        if (above, below) == (SERVICE, WORKER):
            room = places[SERVICE, SDK] - x - 20
        for i, line in enumerate(textwrap.wrap(names, int(room / SMALL_LETTER))):
            yield _label(x + 10, start + 22 + 14 * i, line, size=11, colour="#333")


def _label(x: float, y: float, text: str, *, size: int, weight: str = "normal", colour: str = "#000") -> str:
    """Return a line of text."""
    return (
        f'<text x="{x:.0f}" y="{y:.0f}" font-size="{size}" font-weight="{weight}" fill="{colour}">{escape(text)}</text>'
    )


def main() -> int:
    """Write the picture, or say whether it is stale."""
    parser = argparse.ArgumentParser(prog="python -m tools.house", description="The picture of the house.")
    parser.add_argument("--check", action="store_true", help="write nothing; fail where the picture is stale")
    arguments = parser.parse_args()
    picture = draw(read())
    if arguments.check:
        stale = not PICTURE.exists() or PICTURE.read_text("utf-8") != picture
        sys.stdout.write("docs/pictures/house.svg is stale: make house\n" if stale else "")
        return int(stale)
    PICTURE.write_text(picture, "utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
