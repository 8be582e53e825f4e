"""Would the tests see it? Small faults are put into modules, one at a time, and the tests run.

    nice python benchmarks/mutation.py                          40 faults in each module below
    nice python benchmarks/mutation.py grids.polygons --faults 100
    nice python benchmarks/mutation.py --all grids.polygons     every fault there is

A fault is a comparison turned or made strict, an operator or a number changed, a condition
negated, ``min`` for ``max``, a check left out. Each goes into a copy of the package, and the tests
of its module run there until the first fails. A fault that no test sees is printed with its line:
either it changes nothing (then say why) or a test is missing. Faults in messages and annotations
are left out.

Modules with kernels are tested uncompiled: small tests are faster so, and no compiled code of
another fault is taken for that of this one.

mutmut leaves decorated functions alone, which kernels and cached properties are; cosmic-ray takes
no samples and writes into the tree it tests.
"""

import argparse
import ast
import multiprocessing
import os
import random
import shutil
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

ROOT = Path(__file__).parents[1]
#: the tests of each module, those that fail soonest first
TESTS = {
    "grids.polygons": ["polygons", "partition"],
    "grids.dual_mesh": ["dual_mesh"],
    "grids.checks": ["checks", "partition"],
    "elements.influence": ["influence"],
    "elements.edge_weights": ["edge_weights"],
    "contact.hull": ["load", "punch"],
    "contact.load": ["load", "paths", "punch"],
    "contact.unilateral": ["unilateral"],
    "post.functional": ["functional"],
    "post.conserve": ["postprocess"],
    "post.estimate": ["estimate"],
    "solutions.bounds": ["bounds"],
    "report.data": ["footing", "report_bodies"],
}
SEED = 14
#: imported once, before the tests of any fault run in a process of their own
COMMON = [
    "hypothesis.extra.numpy", "matplotlib", "numba", "pytest", "scipy.sparse.linalg",
    "scipy.spatial", "skfem",
]  # fmt: skip

OPERATORS: dict[type, tuple[type, ...]] = {
    ast.Add: (ast.Sub,),
    ast.Sub: (ast.Add,),
    ast.Mult: (ast.Div,),
    ast.Div: (ast.Mult,),
    ast.FloorDiv: (ast.Mult,),
    ast.Mod: (ast.Add,),
    ast.Pow: (ast.Mult,),
    ast.MatMult: (ast.Mult,),
    ast.BitAnd: (ast.BitOr,),
    ast.BitOr: (ast.BitAnd,),
    ast.And: (ast.Or,),
    ast.Or: (ast.And,),
    ast.Lt: (ast.LtE, ast.Gt),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
NAMES = {
    "min": "max",
    "max": "min",
    "minimum": "maximum",
    "maximum": "minimum",
    "any": "all",
    "all": "any",
    "argmin": "argmax",
    "argmax": "argmin",
    "zeros": "ones",
    "ones": "zeros",
    "cos": "sin",
    "sin": "cos",
    "hstack": "vstack",
}


@dataclass(frozen=True)
class Fault:
    """A piece of a file and what stands there instead; offsets in bytes of its text."""

    start: int
    end: int
    line: int
    new: str


def changed(node: ast.AST, **fields) -> str:
    """The source of a node with some fields replaced."""
    other = type(node)(**{name: getattr(node, name, None) for name in node._fields} | fields)
    return "(" + ast.unparse(ast.fix_missing_locations(other)) + ")"


def replacements(node: ast.AST) -> Iterator[str]:
    """What may stand at the place of a node."""
    match node:
        case ast.BinOp(op=op) | ast.BoolOp(op=op) | ast.AugAssign(op=op):
            for new in OPERATORS.get(type(op), ()):
                source = changed(node, op=new())
                yield source[1:-1] if isinstance(node, ast.AugAssign) else source
        case ast.Compare(ops=[first, *others]):
            for new in OPERATORS.get(type(first), ()):
                yield changed(node, ops=[new(), *others])
        case ast.UnaryOp(op=ast.USub() | ast.Not() | ast.Invert(), operand=operand):
            yield "(" + ast.unparse(operand) + ")"
        case ast.Constant(value=bool(value)):
            yield str(not value)
        case ast.Constant(value=int(value)):
            yield f"({value + 1})"
        case ast.Constant(value=float(value)):
            yield f"({2 * value or 1.0})"
        case ast.Attribute(attr=name) if name in NAMES:
            yield changed(node, attr=NAMES[name])
        case ast.Name(id=name) if name in NAMES:
            yield NAMES[name]
        case ast.IfExp(test=test):
            yield changed(node, test=ast.UnaryOp(ast.Not(), test))
        case ast.Raise() | ast.Break() | ast.Expr(value=ast.Call()):
            yield "pass"


def nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a module where a fault changes what it does, in the order of the text.

    Not those in annotations, decorators and messages.
    """
    for field, value in ast.iter_fields(tree):
        if field in ("annotation", "returns", "decorator_list", "keywords") and isinstance(
            tree, ast.AnnAssign | ast.arg | ast.FunctionDef | ast.ClassDef
        ):
            continue
        for child in value if isinstance(value, list) else [value]:
            if not isinstance(child, ast.AST) or isinstance(child, ast.JoinedStr):
                continue
            if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
                continue
            yield child
            if not isinstance(child, ast.Raise):
                yield from nodes(child)


def faults(source: str) -> list[Fault]:
    """Every fault that can be put into a module."""
    lines = [0]
    for line in source.encode().splitlines(keepends=True):
        lines.append(lines[-1] + len(line))
    return [
        Fault(
            lines[node.lineno - 1] + node.col_offset,
            lines[node.end_lineno - 1] + node.end_col_offset,
            node.lineno,
            new,
        )
        for node in nodes(ast.parse(source))
        for new in replacements(node)
    ]


def inserted(source: str, fault: Fault) -> str:
    """The text of a module with a fault in it."""
    text = source.encode()
    return (text[: fault.start] + fault.new.encode() + text[fault.end :]).decode()


class Brief:
    """A plugin of pytest: the first example that fails is enough, no simpler one is sought."""

    def pytest_sessionstart(self) -> None:
        from hypothesis import Phase, settings

        phases = [Phase.explicit, Phase.generate]
        settings.register_profile("brief", settings.default, phases=phases)
        settings.load_profile("brief")


def run_tests(folder: str, tests: list[str], compiled: bool) -> None:
    """Run tests in a copy of the package until one fails; the exit code tells whether."""
    import numba

    numba.config.DISABLE_JIT = not compiled
    sys.dont_write_bytecode = True  # its date would not tell two faults of one second apart
    os.chdir(folder)
    sys.path.insert(0, folder)
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    os.dup2(silent, 2)
    import pytest

    options = ["-x", "-n0", "-p", "no:cacheprovider", "--tb=no"]
    options += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # hypothesis is there already
    sys.exit(int(pytest.main([*options, *tests], plugins=[Brief()])))


def passes(context, folder: Path, tests: list[str], compiled: bool, limit: float) -> bool:
    """Whether tests pass within ``limit`` seconds."""
    process = context.Process(target=run_tests, args=(str(folder), tests, compiled))
    process.start()
    process.join(limit)
    if process.is_alive():
        process.kill()
        process.join()
    return process.exitcode == 0


def study(context, folder: Path, module: str, number: int | None) -> tuple[int, list[str]]:
    """Put faults into one module; how many, and the lines of those that no test saw."""
    path = folder / "skfem_dual" / (module.replace(".", "/") + ".py")
    source = path.read_text()
    tests = [f"tests/test_{name}.py" for name in tests_of(module)] + [str(path)]
    compiled = "kernels.compiled" not in source
    start = perf_counter()
    if not passes(context, folder, tests, compiled, 600):
        raise RuntimeError(f"the tests of {module} fail without any fault: {' '.join(tests)}")
    limit = 10 + 5 * (perf_counter() - start)
    sample = faults(source)
    if number is not None and number < len(sample):
        sample = random.Random(SEED).sample(sample, number)
    unseen = []
    for fault in sorted(sample, key=lambda fault: fault.start):
        path.write_text(inserted(source, fault))
        if passes(context, folder, tests, compiled, limit):
            old = source.encode()[fault.start : fault.end].decode()
            unseen.append(f"{module}:{fault.line}: {' '.join(old.split())}  ->  {fault.new}")
            print("  " + unseen[-1], flush=True)
    path.write_text(source)
    return len(sample), unseen


def tests_of(module: str) -> list[str]:
    """Names of the tests of a module: those named after it, if no others are known."""
    if module in TESTS:
        return TESTS[module]
    name = module.split(".")[-1]
    if not (ROOT / "tests" / f"test_{name}.py").is_file():
        raise SystemExit(f"expected a module with tests/test_{name}.py, or one of {list(TESTS)}")
    return [name]


def main(modules: list[str] | None = None, number: int | None = 40) -> dict[str, tuple]:
    """Print and return the number of faults in each module and those that no test saw."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(COMMON)
    results = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for part in ("skfem_dual", "tests", "examples", "benchmarks"):
            shutil.copytree(
                ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__")
            )
        for part in ("pyproject.toml", "README.md"):
            shutil.copy(ROOT / part, folder)
        for module in modules or TESTS:
            start = perf_counter()
            total, unseen = study(context, folder, module, number)
            results[module] = total, unseen
            print(
                f"{module:24s} {total:4d} faults, {total - len(unseen):4d} seen, "
                f"{len(unseen):3d} not; {perf_counter() - start:.0f} s",
                flush=True,
            )
    return results


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("modules", nargs="*", metavar="module")
    parser.add_argument("--faults", type=int, default=40, help="in each module")
    parser.add_argument("--all", action="store_true", help="every fault there is")
    arguments = parser.parse_args()
    main(arguments.modules, None if arguments.all else arguments.faults)
