"""Pictures without a ground, for light pages and for dark ones.

In the twin for dark pages, named ``*.dark.*``, ink is light and pale fills are dull; colour maps,
and what is drawn on them, stay as they are.
"""

import re
from colorsys import hls_to_rgb, rgb_to_hls
from pathlib import Path

import matplotlib.pyplot as plt
from gallery import STYLE
from matplotlib.artist import Artist
from matplotlib.collections import Collection
from matplotlib.colors import to_rgba
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text
from PIL import Image

#: lightness of ink up to which, and of fills from which on, colours change, and to what
INK, PALE, LIGHT_INK, DULL = 0.35, 0.7, 0.9, 0.25
#: bytes of a PNG from which on it has fewer pixels; with fewer colours shades would show bands
LARGE = 300_000


def twin(path: Path) -> Path:
    """The file of the same picture for dark pages."""
    return path.with_suffix(f".dark{path.suffix}")


def save_twins(figure: Figure, path: Path, **options) -> None:
    """Write a figure for light pages and for dark ones."""
    with plt.rc_context(STYLE):
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # all stands in its place
        options["bbox_inches"] = figure.get_tightbbox().padded(plt.rcParams["savefig.pad_inches"])
        figure.savefig(path, **options)
        darken(figure)
        figure.savefig(twin(path), **options)
    for file in (path, twin(path)):
        if file.suffix == ".svg":  # a hundredth of a point is enough
            text = file.read_text(encoding="utf-8")
            file.write_text(re.sub(r' d="[^"]*"', _rounded, text), encoding="utf-8")
        if file.suffix == ".png" and file.stat().st_size > LARGE:
            image = Image.open(file)
            image = image.resize([3 * n // 4 for n in image.size])
            image.save(file)
            if file.stat().st_size > LARGE:  # nothing but lines is still so large
                image.quantize(256, method=Image.Quantize.FASTOCTREE).save(file)


def _rounded(path: re.Match) -> str:
    """The data of a path with two decimals."""
    return re.sub(r"(\.\d\d)\d+", r"\1", path[0])


def darken(figure: Figure) -> None:
    """Change the colours of a figure for a dark page."""
    for ax in figure.axes:
        kept = set()
        if any(map(is_mapped, ax.get_children())):
            kept = {*ax.lines, *ax.collections, *ax.patches}
            kept |= {text for text in ax.texts if text.get_bbox_patch() is not None}
        for artist in ax.get_children():
            if artist not in kept:
                for part in artist.findobj():
                    turn(part)
    for legend in figure.legends:
        for part in legend.findobj():
            turn(part)


def is_mapped(artist: Artist) -> bool:
    """Whether its colours stand for numbers."""
    mapped = isinstance(artist, Collection) and artist.get_array() is not None
    return mapped or isinstance(artist, (AxesImage, ContourSet))


def turn(artist: Artist) -> None:
    """Change the colours of an artist."""
    if isinstance(artist, Text):
        artist.set_color(turned(artist.get_color()))
        for patch in (artist.get_bbox_patch(), getattr(artist, "arrow_patch", None)):
            if patch is not None:
                turn(patch)
    elif isinstance(artist, Line2D):
        artist.set(
            markeredgecolor=turned(artist.get_markeredgecolor()),
            markerfacecolor=turned(artist.get_markerfacecolor()),
        )
        artist.set_color(turned(artist.get_color()))
    elif isinstance(artist, Patch):
        edge, face = turned(artist.get_edgecolor()), turned(artist.get_facecolor())
        artist.set(edgecolor=edge, facecolor=face)
    elif isinstance(artist, Collection):
        edges, faces = artist.get_edgecolor(), artist.get_facecolor()
        artist.set(edgecolor=[*map(turned, edges)], facecolor=[*map(turned, faces)])


def turned(color):
    """Black for white, dull for pale; other colours read on both."""
    *rgb, alpha = to_rgba(color)
    if alpha == 0:
        return "none"
    hue, lightness, saturation = rgb_to_hls(*rgb)
    grey = max(rgb) - min(rgb) < 0.05
    if grey and lightness < INK:
        lightness = LIGHT_INK
    elif lightness > PALE:
        lightness, saturation = (0.1 if grey else DULL), 0.6 * saturation
    return (*hls_to_rgb(hue, lightness, 0.0 if grey else saturation), alpha)
