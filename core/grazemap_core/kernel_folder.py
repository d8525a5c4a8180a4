"""The cache of compiled kernels: one folder for each version of all that the machine code depends on.

The folder's name contains a hash of the core's sources, the versions of Python, numba, llvmlite and numpy, the
processor that code is generated for, and the settings that choose instructions. So nothing in a folder is ever out of
date. The folder lies below NUMBA_CACHE_DIR if that is set, otherwise in the `__pycache__` of the core.

Each compiled function is a file of its own, an *entry*, with a checksum. Numba itself keeps an index of each function,
which two processes at once, or one that is killed between two writes, can leave with the data of another signature. An
entry is renamed into its place when it is complete; one that is damaged is compiled again alone. A *component* is a
list of entries that are loaded together (`warmup`). What the folder does not hold is looked for in a folder of the same
name in the package of kernels that were compiled ahead of time (`compiled_ahead`).
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import pickle
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any
from uuid import uuid4

import llvmlite.binding
from numba.core import caching, codegen, config, dispatcher
from numba.core.registry import cpu_target
from numba.core.serialize import dumps

from grazemap_core.compiled_ahead import made_from, package_folder

_CORE = Path(__file__).parent
_SETTINGS = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "USING_SVML")
_DIGEST = hashlib.sha256
_DIGEST_BYTES = _DIGEST().digest_size
_COMPONENT = ".kernels"

_chosen: Path | None = None
_used: set[str] = set()
"""The names of the entries that this process has loaded or saved."""


@cache
def folder_name() -> str:
    """Return the name of the folder for this process's kernels."""
    parts = {
        **made_from(),
        "target": cpu_target.target_context.codegen().magic_tuple(),
        "settings": [str(getattr(config, name)) for name in _SETTINGS],
    }
    return f"kernels-{_DIGEST(json.dumps(parts).encode()).hexdigest()[:16]}"


@cache
def folder() -> Path:
    """Return the folder for this process's kernels, the same as long as the process lives."""
    below = _chosen or config.CACHE_DIR or _CORE / "__pycache__"  # type: ignore[attr-defined]  # set by numba
    return Path(below) / folder_name()


def choose_folder(below: Path) -> None:
    """Have the kernels of this process lie below another folder than NUMBA_CACHE_DIR; call this before any is used."""
    global _chosen
    _chosen = below
    folder.cache_clear()


def environment() -> dict[str, str]:
    """Return the environment variables with which a process has the same kernels.

    Here they may be those of this very processor only because numba was imported before the core.
    """
    same = {} if "NUMBA_CPU_NAME" in os.environ else {"GRAZEMAP_KERNELS": "native"}
    return {"NUMBA_CACHE_DIR": str(folder().parent), **same}


def choose_cache() -> None:
    """Set the cache of all functions of the core that are decorated afterwards; those of others keep numba's."""
    dispatcher.FunctionCache = _cache_of  # type: ignore[attr-defined]  # numba asks it for every cached function


def record(component: str) -> None:
    """Store which entries a component consists of: all that this process has used until now."""
    _write(folder() / f"{component}{_COMPONENT}", json.dumps(sorted(_used)).encode())


def holds(component: str) -> bool:
    """Return whether all entries of a component are stored, and undamaged."""
    return any(_holds(place, component) for place in _places())


def _holds(place: Path, component: str) -> bool:
    try:
        names = json.loads((place / f"{component}{_COMPONENT}").read_bytes())
    except (OSError, ValueError):
        return False
    return all(_stored(name) is not None for name in names)


def _places() -> list[Path]:
    """Return where entries are looked for: in the folder, and in the package of those compiled ahead of time."""
    package = package_folder()
    return [folder()] if package is None else [folder(), package / folder_name()]


def _stored(name: str) -> bytes | None:
    """Return the content of an entry; None if there is none that is undamaged."""
    return next((content for place in _places() if (content := _content(place / name)) is not None), None)


class _Entries:
    """The entries of one function, with the interface of numba's index of it."""

    def __init__(self, name: str) -> None:
        self._name = name

    def _entry(self, key: Any) -> Path:
        return folder() / f"{self._name}.{_DIGEST(repr(key).encode()).hexdigest()[:16]}.kernel"

    def save(self, key: Any, data: Any) -> None:
        """Store an entry; without space for it the function is compiled in every process."""
        content = dumps((key, data))  # type: ignore[no-untyped-call]
        path = self._entry(key)
        try:
            _write(path, _DIGEST(content).digest() + content)
        except OSError as error:
            logging.getLogger(__name__).warning("a compiled kernel cannot be stored: %s", error)
        else:
            _used.add(path.name)

    def load(self, key: Any) -> Any:
        """Return what was stored under a key; None if nothing was, or if it is damaged."""
        path = self._entry(key)
        content = _stored(path.name)
        if content is None:
            return None
        stored, data = pickle.loads(content)
        if stored != key:
            return None
        _used.add(path.name)
        return data

    def flush(self) -> None:
        """Remove every entry."""
        for path in folder().glob(f"{self._name}.*.kernel"):
            path.unlink(missing_ok=True)


class _Locator(caching._CacheLocator):
    """The folder of the core's kernels. Its name stands for the sources, so that files' times say nothing."""

    def ensure_cache_path(self) -> None:
        """Do nothing: the folder is made when an entry is written."""

    def get_cache_path(self) -> str:
        """Return the folder."""
        return str(folder())

    def get_source_stamp(self) -> tuple[()]:
        """Return what is the same for all entries of a folder."""
        return ()

    def get_disambiguator(self) -> str:
        """Return nothing: names of functions are unique with their module's."""
        return ""

    @classmethod
    def from_function(cls, py_func: Callable[..., object], py_file: str) -> _Locator:
        """Return the locator, for every function of the core."""
        return cls()


_Library: Any = getattr(codegen, "JITCodeLibrary", object)
_LAZY = hasattr(_Library, "_set_compiled_object") and hasattr(_Library, "enable_object_caching")
"""Whether numba has what `_LoadedLibrary` knows of it."""


class _LoadedLibrary(_Library):  # type: ignore[misc]
    """Machine code that was loaded. Its intermediate code is parsed when a function that is compiled here calls it.

    Hardly any is, and parsing all would take a third of the time and half of the memory of loaded kernels.
    """

    _bitcode = b""
    _shared_module: Any

    def _get_module_for_linking(self) -> Any:
        if self._shared_module is None:
            self._shared_module = llvmlite.binding.parse_bitcode(self._bitcode)
        return super()._get_module_for_linking()

    @classmethod
    def _unserialize(cls, generator: Any, state: Any) -> Any:
        name, _, (machine_code, bitcode, symbols) = state
        self = generator.create_library(name)
        self.enable_object_caching()
        self._set_compiled_object(machine_code)
        self._bitcode = bitcode
        self._finalize_final_module()
        generator._engine._defined_symbols.update(symbols)
        return self


def _with_symbols(library: Any) -> tuple[Any, ...]:
    """Return a serialized library with the names of what its intermediate code defines."""
    name, kind, (machine_code, bitcode) = library
    module = llvmlite.binding.parse_bitcode(bitcode)
    items = [*module.functions, *module.global_variables]
    return name, kind, (machine_code, bitcode, [item.name for item in items if not item.is_declaration])


class _KernelImpl(caching.CompileResultCacheImpl):
    _locator_classes = [_Locator]  # type: ignore[list-item]

    def reduce(self, cres: Any) -> Any:
        """Return what is stored of a compiled function."""
        library, *others = super().reduce(cres)  # type: ignore[no-untyped-call]
        return _with_symbols(library) if _LAZY else library, *others

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """Return the compiled function from what is stored."""
        if not _LAZY:
            return super().rebuild(target_context, payload)  # type: ignore[no-untyped-call]
        generator = target_context.codegen()
        usual, generator._library_class = generator._library_class, _LoadedLibrary
        try:
            return super().rebuild(target_context, payload)  # type: ignore[no-untyped-call]
        finally:
            generator._library_class = usual


class _KernelCache(caching.FunctionCache):
    """Numba's cache of a function, with `_Entries` instead of an index."""

    _impl_class = _KernelImpl

    def __init__(self, py_func: Callable[..., object]) -> None:
        super().__init__(py_func)  # type: ignore[no-untyped-call]
        self._cache_file: Any = _Entries(f"{py_func.__module__}.{py_func.__qualname__}")

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled function, or None if it must be compiled: also if what is stored cannot be loaded."""
        try:
            return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except Exception as error:
            logging.getLogger(__name__).warning("the compiled kernel %s cannot be loaded: %r", self._name, error)
            return None


def _cache_of(py_func: Callable[..., object]) -> Any:
    """Return the cache of a function: numba's own for those of others."""
    ours = py_func.__module__.partition(".")[0] == __package__
    return _KernelCache(py_func) if ours else caching.FunctionCache(py_func)  # type: ignore[no-untyped-call]


def _write(path: Path, content: bytes) -> None:
    """Write a file that is complete or not there."""
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f"{path.name}.{uuid4().hex[:16]}.tmp")
    try:
        unfinished.write_bytes(content)
        os.replace(unfinished, path)
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise


def _content(path: Path) -> bytes | None:
    """Return the content of an entry; None if there is none, or if its checksum does not fit."""
    try:
        stored = path.read_bytes()
    except OSError:
        return None
    digest, content = stored[:_DIGEST_BYTES], stored[_DIGEST_BYTES:]
    if _DIGEST(content).digest() == digest:
        return content
    logging.getLogger(__name__).warning("the compiled kernel %s is damaged and is compiled again", path.name)
    return None
