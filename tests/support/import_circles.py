"""Counts circles of imports in the four packages, and prints them: `make lint` runs it, and fails where there are any.

Imports inside functions count; those for type checkers do not run, and do not count. A circle is one of modules, or
one of the modules and packages that stand side by side in a package, each with all that is in it.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Set

import grimp

PACKAGES = ("grazemap", "grazemap_core", "grazemap_worker", "grazemap_service")
Imports = Mapping[str, Set[str]]


def imports_of(packages: tuple[str, ...] = PACKAGES) -> Imports:
    """Return the modules that each module imports, of these packages only."""
    graph = grimp.build_graph(*packages, exclude_type_checking_imports=True, cache_dir=None)
    return {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}


def circles(imports: Imports) -> list[list[str]]:
    """Return the strongly connected components with more than one member, each sorted."""
    reached = {module: _reached(module, imports) for module in imports}
    components = {
        tuple(sorted(other for other in others if module in reached[other])): None
        for module, others in sorted(reached.items())
    }
    return [list(circle) for circle in components if len(circle) > 1]


def _reached(module: str, imports: Imports) -> set[str]:
    """Return what a module imports, directly or not; itself among it if it stands in a circle."""
    reached: set[str] = set()
    left = list(imports[module])
    while left:
        other = left.pop()
        if other not in reached:
            reached.add(other)
            left.extend(imports[other])
    return reached


def side_by_side(package: str, imports: Imports) -> Imports:
    """Return the imports between the modules and packages that stand directly in a package."""
    depth = package.count(".") + 2

    def member(module: str) -> str:
        return ".".join(module.split(".")[:depth])

    inside = [module for module in imports if module.startswith(package + ".")]
    graph: dict[str, set[str]] = {member(module): set() for module in inside}
    for module in inside:
        others = {member(other) for other in imports[module] if other.startswith(package + ".")}
        graph[member(module)] |= others - {member(module)}
    return graph


def all_circles(imports: Imports) -> list[list[str]]:
    """Return the circles of modules, and those of the members of each package."""
    packages = {module.rpartition(".")[0] for module in imports} - {""}
    candidates = [
        *circles(imports),
        *(c for package in sorted(packages) for c in circles(side_by_side(package, imports))),
    ]
    return [circle for place, circle in enumerate(candidates) if circle not in candidates[:place]]


if __name__ == "__main__":
    loops = all_circles(imports_of())
    print(f"{len(loops)} import circles in {', '.join(PACKAGES)}")
    for circle in loops:
        print("  " + ", ".join(circle))
    sys.exit(1 if loops else 0)
