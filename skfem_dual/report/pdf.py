"""A page as PDF, through WeasyPrint."""

import warnings
from typing import Any


def require_pdf() -> Any:
    """WeasyPrint.

    Raises
    ------
    ImportError
        If it is missing, or the library pango it needs from the system.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # its own, which may be errors
            import weasyprint
    except ImportError as error:
        raise ImportError(
            "a PDF takes WeasyPrint. Remedy: pip install 'skfem-dual[pdf]', or write .html and "
            "print it from a browser"
        ) from error
    except OSError as error:
        raise ImportError(
            "WeasyPrint does not find the library pango. Remedy: install it, by apt-get install "
            "libpango-1.0-0 libpangoft2-1.0-0 on Debian or Ubuntu, or write .html and print it "
            "from a browser"
        ) from error
    return weasyprint


def write_pdf(path: str, text: str) -> None:
    """Write an HTML page to a PDF file; nothing is loaded from elsewhere."""
    require_pdf().HTML(string=text).write_pdf(path)
