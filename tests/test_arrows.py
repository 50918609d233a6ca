"""The import arrows: `garments <- sim <- learn`, `eval` reads all, heavy libraries stay where they belong.

Everything is read from the source with `ast`, so that a module is judged where its libraries are missing too.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ("garments", "sim", "learn", "eval")

# package: the packages of muslin that it may import, at any depth of its code
MAY_IMPORT = {
    "muslin.garments": {"muslin.garments"},
    "muslin.sim": {"muslin.garments", "muslin.sim"},
    "muslin.learn": {"muslin.garments", "muslin.sim", "muslin.learn"},
    "muslin.eval": {"muslin.garments", "muslin.sim", "muslin.learn", "muslin.eval"},
}
# package: libraries that importing it must not import, directly or through other modules of muslin
LOADS_NO = {
    "muslin.garments": {"warp", "torch"},
    "muslin.sim": {"torch"},
    "muslin.sim.body": {"warp"},
    "muslin.sim.motion": {"warp"},
    "muslin.sim.dataset": {"warp"},
    "muslin.sim.view": {"warp"},
    "muslin.eval": {"torch"},
    "muslin.eval.metrics": {"warp"},
}
# Scripts that made committed data with libraries that nothing else needs: free in what they import, but
# no other module may import them.
MADE_DATA = "muslin.sim.body.bake"


def module_name(path: Path) -> str:
    """Return the dotted name under which a source file is imported."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(("muslin", *(parts[:-1] if parts[-1] == "__init__" else parts)))


MODULES = {module_name(path): path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py"))}


def inside(name: str, package: str) -> bool:
    """Whether a dotted name is the package or lies in it."""
    return name == package or name.startswith(package + ".")


def statements(tree: ast.AST, *, on_import: bool) -> Iterator[ast.Import | ast.ImportFrom]:
    """Yield the import statements of a tree; with `on_import` only those that run on import of the module."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node
        elif on_import and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            continue
        elif on_import and isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            for alternative in node.orelse:
                yield from statements(ast.Module([alternative], []), on_import=on_import)
        else:
            yield from statements(node, on_import=on_import)


@cache
def imports(module: str, *, on_import: bool) -> frozenset[str]:
    """Return the dotted names that a module imports: existing modules of muslin, and libraries."""
    path = MODULES[module]
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    names: set[str] = set()
    for statement in statements(ast.parse(path.read_text(encoding="utf-8")), on_import=on_import):
        if isinstance(statement, ast.Import):
            names.update(alias.name for alias in statement.names)
            continue
        base = statement.module or ""
        if statement.level:
            above = package.split(".")[: len(package.split(".")) - statement.level + 1]
            base = ".".join((*above, base) if base else above)
        names.add(base)
        names.update(full for alias in statement.names if (full := f"{base}.{alias.name}") in MODULES)
    return frozenset(names)


def with_parents(name: str) -> Iterator[str]:
    """Yield the modules of muslin that run when `name` is imported: its parent packages, then itself."""
    parts = name.split(".")
    for end in range(1, len(parts) + 1):
        if (parent := ".".join(parts[:end])) in MODULES:
            yield parent


def chain_to(module: str, library: str) -> list[str] | None:
    """Return a shortest chain of imports from a module to a library, or None where it does not load it."""
    start = list(with_parents(module))
    came_from: dict[str, str | None] = dict.fromkeys(start)
    queue = start
    while queue:
        current = queue.pop(0)
        for name in sorted(imports(current, on_import=True)):
            if inside(name, library):
                chain = [library, current]
                while (previous := came_from[chain[-1]]) is not None:
                    chain.append(previous)
                return chain[::-1]
            for loaded in with_parents(name):
                if loaded not in came_from:
                    came_from[loaded] = current
                    queue.append(loaded)
    return None


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_arrows_between_packages(package: str) -> None:
    allowed = MAY_IMPORT[package]
    wrong = [
        f"{module} imports {name}"
        for module in MODULES
        if inside(module, package)
        for name in sorted(imports(module, on_import=False))
        if inside(name, "muslin") and not any(inside(name, other) for other in allowed)
    ]
    assert not wrong, f"{package} may import only {sorted(allowed)}: {wrong}"


@pytest.mark.parametrize("package", LOADS_NO)
def test_importing_stays_light(package: str) -> None:
    chains = [
        " -> ".join(chain)
        for library in sorted(LOADS_NO[package])
        for module in MODULES
        if inside(module, package) and not inside(module, MADE_DATA) and (chain := chain_to(module, library))
    ]
    assert not chains, f"importing {package} loads what it must not: {chains}"


def test_torch_is_named_only_in_learn() -> None:
    wrong = [
        module
        for module in MODULES
        if not inside(module, "muslin.learn")
        and not inside(module, MADE_DATA)
        and any(inside(name, "torch") for name in imports(module, on_import=False))
    ]
    assert not wrong, f"the core install has no torch; import it in muslin.learn only, not in {wrong}"


def test_nothing_depends_on_what_made_the_data() -> None:
    wrong = [
        module
        for module in MODULES
        if not inside(module, MADE_DATA)
        and any(inside(name, MADE_DATA) for name in imports(module, on_import=False))
    ]
    assert not wrong, f"{MADE_DATA} needs libraries that muslin is installed without; imported by {wrong}"


def test_packages_are_imported_by_their_installed_name() -> None:
    wrong = [
        f"{module} imports {name}"
        for module in MODULES
        for name in sorted(imports(module, on_import=False))
        if name.partition(".")[0] in FOLDERS
    ]
    assert not wrong, f"write muslin.{{garments,sim,learn,eval}}: {wrong}"


def test_the_reader_of_imports_sees_what_it_must() -> None:
    source = (
        "import a.b\n"
        "from typing import TYPE_CHECKING\n"
        "if TYPE_CHECKING:\n    import only_for_types\nelse:\n    import otherwise\n"
        "try:\n    import tried\nexcept ImportError:\n    pass\n"
        "class C:\n    import in_class\n    def f(self):\n        import lazy\n"
    )

    def names(*, on_import: bool) -> set[str]:
        found = statements(ast.parse(source), on_import=on_import)
        return {alias.name for statement in found for alias in statement.names} - {"TYPE_CHECKING"}

    assert names(on_import=True) == {"a.b", "otherwise", "tried", "in_class"}
    assert names(on_import=False) == {"a.b", "only_for_types", "otherwise", "tried", "in_class", "lazy"}
