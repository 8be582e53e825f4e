"""Errors and warnings in one line each."""

from ..terminal import tell


def show_warning(warned: list[str], message: Warning | str, *where: object) -> None:
    warned.append(one_line(message))
    tell(f"warning: {warned[-1]}")


def one_line(error: BaseException | Warning | str) -> str:
    return " ".join(str(error).split()) or type(error).__name__
