"""Files that are written whole or not at all, and never onto one another."""

import os
import secrets
import stat
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from xml.sax.saxutils import escape

from ..arguments import checked_instance, checked_text
from ..messages import shown

PathLike = str | os.PathLike[str]


def require_vtu(path: PathLike) -> None:
    """Refuse names of files that do not end in .vtu, with a ValueError, and what is no path."""
    if Path(checked_path(path)).suffix.lower() != ".vtu":
        raise ValueError(f"expected a file name ending in .vtu, got {shown(path)}")


def vtu_name(name: str) -> str:
    """The name of data as it stands in a VTU file, in which meshio writes it as it is.

    Raises
    ------
    TypeError
        If it is no text.
    ValueError
        If it is empty, or has characters that are not printed.
    """
    if not checked_text("the name of data", name).strip() or not name.isprintable():
        raise ValueError(f"expected a name of data in one printed line, got {shown(name)}")
    return escape(name, {'"': "&quot;"}).encode("ascii", "xmlcharrefreplace").decode()


def checked_path(path: PathLike) -> PathLike:
    """The path of a file to write to; a TypeError or ValueError if it is no such path."""
    checked_instance("path", path, (str, os.PathLike))
    if "\0" in str(path):
        raise ValueError(f"expected the path of a file to write to, got {shown(path)}")
    return path


def write_whole(path: PathLike, write: Callable[[str], object]) -> None:
    """Let ``write`` produce a file that replaces ``path`` only when complete.

    ``write`` gets the name of a temporary file in the same folder, with the same suffix in small
    letters, by which libraries know formats. A symbolic link at ``path`` remains one, and a file
    keeps its mode.

    Raises
    ------
    TypeError
        If one is no path, the other no function.
    OSError
        If ``path`` is a folder, a pipe or a device, or it or its folder cannot be written to.
    """
    target = Path(os.path.realpath(checked_path(path)))
    if not callable(write):
        raise TypeError(f"expected a function of a file name for write, got {shown(write)}")
    if not target.parent.is_dir():
        raise FileNotFoundError(
            f"no such folder for {target.name}: {target.parent}. Remedy: make it first"
        )
    mode = _mode_of(target)
    # to replace a file takes the permission of its folder only
    if mode is not None and not os.access(target, os.W_OK):
        raise PermissionError(f"expected a file that may be written, got {path}")
    part = target.parent / f".{target.stem[:40]}-{secrets.token_hex(4)}{target.suffix.lower()}"
    try:
        os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        write(str(part))
        if mode is not None:
            os.chmod(part, mode)
        os.replace(part, target)
    except OSError as error:
        # a name the caller has never seen, or none, as where the disk is full
        if error.errno is not None and error.filename in (None, str(part)):
            raise OSError(error.errno, error.strerror, str(path)) from error
        raise
    finally:
        part.unlink(missing_ok=True)


def require_outputs(
    outputs: Mapping[str, PathLike], inputs: Mapping[str, PathLike] | None = None
) -> None:
    """Refuse files that cannot be written, or that are an input or another output.

    Parameters
    ----------
    outputs, inputs : mapping of str to path
        Paths by what messages call them.

    Raises
    ------
    TypeError
        If they are no mappings of paths.
    OSError
        If a folder is missing or cannot be written to, or a file is a folder, a pipe, a device
        or not writable.
    ValueError
        If an output is an input or another output, also through links.
    """
    checked_instance("outputs", outputs, Mapping, "names of files by what they are called")
    if inputs is not None:
        checked_instance("inputs", inputs, Mapping, "names of files by what they are called")
    taken = dict(inputs or {})
    for name, path in outputs.items():
        target = Path(os.path.realpath(path))
        if not target.parent.is_dir():
            given = Path(path).parent
            folder = target.parent if given.is_dir() else given  # of a link
            raise FileNotFoundError(f"no such folder for {name}: {folder}")
        if _mode_of(target) is not None and not os.access(target, os.W_OK):
            raise PermissionError(f"expected a file that may be written for {name}, got {path}")
        try:
            tempfile.TemporaryFile(dir=target.parent).close()
        except OSError as error:
            raise PermissionError(
                f"cannot write to the folder of {name}, {Path(path).parent}: {error.strerror}"
            ) from error
        for other, used in taken.items():
            if _is_same(path, used):
                raise ValueError(
                    f"expected another file for {name} than for {other}, got {path} for both"
                )
        taken[name] = path


def _mode_of(target: Path) -> int | None:
    """The mode of an existing file that may be replaced, or None."""
    try:
        mode = target.stat().st_mode
    except FileNotFoundError:
        return None
    if not stat.S_ISREG(mode):
        kind = "folder" if stat.S_ISDIR(mode) else "pipe, socket or device"
        raise FileExistsError(f"expected a file to write to, got the {kind} {target}")
    return stat.S_IMODE(mode)


def _is_same(path: PathLike, other: PathLike) -> bool:
    try:
        return os.path.samefile(path, other)  # also through hard links
    except OSError:
        paths = [os.path.normcase(os.path.realpath(p)) for p in (path, other)]
        return paths[0] == paths[1]
