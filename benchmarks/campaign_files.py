"""Damaged files and wrong command lines.

Mesh files of every format meshio writes, grounds in TOML and record files of `sweep` are cut,
scrambled and given impossible numbers. The command line must end with an exit code and one line of
at most 300 characters for whatever it is given, and damaged records must not change an answer.
"""

import contextlib
import io
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import meshio
import numpy as np

import skfem_dual as sd
from skfem_dual.cli import main
from skfem_dual.grids import generate
from skfem_dual.io import read_substrate

Trial = tuple[str, Callable[[], tuple[str, str]]]
#: what numbers in files are replaced by
NUMBERS = (
    *("nan", "inf", "-1", "0", "1e308", "-1e308", "1e-308", "1" + 400 * "0", "99999999999", "x"),
    *("", "2147483648", "4294967296", "-9223372036854775808"),
)
GROUNDS = (
    "[base]\nyoung = 60e6\npoisson = 0.25\n",
    "[base]\nyoung = 60e6\npoisson = 0.25\ngradient = 0.5\n",
    '[[layers]]\nthickness = 2.0\nyoung = 20e6\npoisson = 0.3\nbase = "bonded"\n',
    "[[layers]]\nthickness = 2.0\nyoung = 20e6\npoisson = 0.3\ngradient = 0.1\n"
    "[[layers]]\nthickness = 3.0\nyoung = 10e6\npoisson = 0.4\n"
    "[base]\nyoung = 9e7\npoisson = 0.2\n",
)
#: what values in TOML are replaced by
VALUES = (
    *(
        '""',
        '"x"',
        "{}",
        "[]",
        "true",
        "false",
        "nan",
        "inf",
        "-inf",
        "-1",
        "0",
        "1e308",
        "1e-308",
    ),
    *("5e-324", "1" + 400 * "0", "[1, 2]", "{a = 1}", "1979-05-27", "0x7f", "1_000", "''"),
)
MISSING = ("meshio", "pyvista", "matplotlib", "h5py")


@cache
def folder() -> Path:
    """Where the files of this process are."""
    return Path(tempfile.mkdtemp(prefix="campaign"))


@cache
def sound_files() -> dict[str, bytes]:
    """A sound file of each extension meshio writes, one small mesh in all of them."""
    mesh = generate.disc(n=30)
    points = np.column_stack([mesh.p.T, np.zeros(mesh.p.shape[1])])
    found = {}
    for extension in sorted(meshio.extension_to_filetypes):
        path = folder() / f"sound{extension}"
        try:
            with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
                warnings.simplefilter("ignore")
                meshio.write(path, meshio.Mesh(points, [("triangle", mesh.t.T.astype(int))]))
        except (Exception, SystemExit):  # noqa: BLE001 - formats of other cells
            continue
        if path.exists():
            found[extension] = path.read_bytes()
    return found


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """Something cut, scrambled or replaced."""
    what, n = int(rng.integers(7)), len(content)
    at = int(rng.integers(n))
    if what == 0:
        return content[:at]
    if what == 1:
        other = bytearray(content)
        for i in rng.integers(n, size=int(rng.integers(1, 9))):
            other[i] = int(rng.integers(256))
        return bytes(other)
    if what == 2:
        return content[:at] + rng.bytes(int(rng.integers(1, 40))) + content[at:]
    if what == 3:
        return content[:at] + content[min(n, at + int(rng.integers(1, 200))) :]
    words = content.split(b" ")
    i = int(rng.integers(len(words)))
    if what == 4:  # a number becomes another one
        digits = [k for k, word in enumerate(words) if word.strip().lstrip(b"-").isdigit()]
        i = int(rng.choice(digits)) if digits else i
        words[i] = str(rng.choice(NUMBERS)).encode()
    elif what == 5:
        words[i] = str(rng.choice(NUMBERS)).encode()
    else:
        lines = content.split(b"\n")
        i, j = rng.integers(len(lines), size=2)
        lines[i], lines[j] = lines[j], lines[i]
        return b"\n".join(lines)
    return b" ".join(words)


def called(arguments: list[str]) -> tuple[str, str]:
    """How a command ended, and what it said."""
    said, printed = io.StringIO(), io.StringIO()
    try:
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(printed):
            code = main(arguments)
    except SystemExit as end:
        code = end.code
    except BaseException as error:  # noqa: BLE001 - what would be a traceback
        return "unclear", f"traceback: {error!r}"
    text = said.getvalue().strip()
    if code == 0:
        return "fine", ""
    if code not in (1, 2, 3) or not (text or printed.getvalue().strip()):
        return "unclear", f"exit code {code}: {text}"
    last = text.splitlines()[-1] if text else ""
    if "Traceback" in text or len(last) > 300:
        return "unclear", f"{len(last)} characters: {last}"
    return "clear", last


def mesh_trials(seed: int, n: int = 25) -> Iterator[Trial]:
    """``n`` damaged files of each format, read by ``check``."""
    for number in range(n):
        for extension in sorted(sound_files()):
            yield f"{extension} {number}", lambda k=number, e=extension: _mesh(seed, k, e)


def _mesh(seed: int, number: int, extension: str) -> tuple[str, str]:
    extensions = sorted(sound_files())
    rng = np.random.default_rng([seed, number, extensions.index(extension)])
    path = folder() / f"damaged{extension}"
    path.write_bytes(damaged(sound_files()[extension], rng))
    return called(["check", str(path)])


def ground_trials(seed: int, n: int = 250) -> Iterator[Trial]:
    """Grounds with values, keys or bytes at fault."""
    for number in range(n):
        yield f"ground {number}", lambda k=number: _ground(seed, k)


def _ground(seed: int, number: int) -> tuple[str, str]:
    rng = np.random.default_rng([seed, number])
    text = GROUNDS[number % len(GROUNDS)]
    if rng.uniform() < 0.7:
        lines = text.splitlines()
        i = int(rng.choice([k for k, line in enumerate(lines) if "=" in line]))
        key, _ = lines[i].split("=", 1)
        lines[i] = f"{key}= {rng.choice(VALUES)}" if rng.uniform() < 0.8 else f"x{lines[i]}"
        content = "\n".join(lines).encode()
    else:
        content = damaged(text.encode(), rng)
    path = folder() / "ground.toml"
    path.write_bytes(content)
    try:
        ground = read_substrate(path)
    except (ValueError, TypeError) as error:
        text = str(error)
        return ("clear" if "expected" in text and len(text) < 300 else "unclear"), text
    except Exception as error:  # noqa: BLE001
        return "unclear", repr(error)
    return "fine", repr(ground)


def record_trials(seed: int, n: int = 150) -> Iterator[Trial]:
    """Files of results, damaged between two runs of one sweep."""
    for number in range(n):
        yield f"records {number}", lambda k=number: _records(seed, k)


def _square(x: float) -> dict[str, float]:
    return {"square": x * x}


def _records(seed: int, number: int) -> tuple[str, str]:
    rng = np.random.default_rng([seed, number])
    path, cases = folder() / "records", [{"x": float(x)} for x in range(6)]
    path.unlink(missing_ok=True)
    sd.sweep(_square, cases, file=path)
    path.write_bytes(damaged(path.read_bytes(), rng))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = sd.sweep(_square, cases, file=path)
    except ValueError as error:
        return ("clear" if "expected" in str(error) else "unclear"), str(error)
    except Exception as error:  # noqa: BLE001
        return "unclear", repr(error)
    right = all(o.result == {"square": o.case["x"] ** 2} for o in found.outcomes)
    return ("fine", "") if right else ("wrong", "other results than those of the cases")


def command_trials(seed: int, n: int = 60) -> Iterator[Trial]:
    """Command lines with words and numbers that do not fit, and without some libraries."""
    path = folder() / "mesh.vtu"
    generate.disc(n=30).save(str(path))
    good = ["solve", str(path), "--young", "30", "--poisson", "0.25", "--force", "1"]
    options = ("--young", "--poisson", "--force", "--at", "--origin", "--settlement", "--png")
    options += ("--vtu", "--json", "--substrate", "--rtol", "--moments", "--report", "--color")
    words = (
        *NUMBERS,
        "-",
        "--",
        "nan nan",
        str(folder()),
        "/nowhere/a.vtu",
        str(path),
        "é",
        "0 0",
    )
    picture, content = str(folder() / "picture.png"), path.read_bytes()
    yield "solve", lambda: called(good)
    for number in range(n):
        rng = np.random.default_rng([seed, number])
        line = list(good)
        for _ in range(int(rng.integers(1, 4))):
            i = int(rng.integers(len(line) + 1))
            if rng.uniform() < 0.4:
                line[i:i] = [str(rng.choice(options)), *str(rng.choice(words)).split(" ")]
            elif i < len(line) and line[i] != str(path):
                line[i : i + 1] = str(rng.choice(words)).split(" ")
        yield " ".join(line[2:]), lambda a=line: _command(a, path, content)
    for name in MISSING:
        yield (
            f"without {name}",
            lambda name=name: _without(name, [*good, "--png", picture]),
        )


def _command(line: list[str], path: Path, content: bytes) -> tuple[str, str]:
    """A command in the folder of the campaign, which must leave its mesh as it is."""
    path.write_bytes(content)
    with contextlib.chdir(folder()):
        found = called(line)
    if path.read_bytes() != content:
        return "wrong", "the mesh that was read has been overwritten"
    return found


def _without(library: str, line: list[str]) -> tuple[str, str]:
    code = f"import sys; sys.modules[{library!r}] = None\nfrom skfem_dual.cli import main\n"
    code += f"sys.exit(main({line!r}))"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    text = ended.stderr.strip()
    if "Traceback" in text:
        return "unclear", f"traceback: {text.splitlines()[-1]}"
    return ("fine" if ended.returncode == 0 else "clear"), text


def trials(seed: int = 0, what: str = "meshes") -> Iterator[Trial]:
    """Label and judged trial of one kind of files."""
    kinds = {"meshes": mesh_trials, "grounds": ground_trials, "records": record_trials}
    return {**kinds, "commands": command_trials}[what](seed)
