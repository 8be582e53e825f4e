"""Of the two files of each picture, the page shows that for its theme; see `dark`."""

from pathlib import Path

import matplotlib.pyplot as plt
from dark import save_twins, twin
from docutils import nodes
from sphinx.transforms import SphinxTransform
from sphinx_gallery.utils import scale_image


def scrape(block, block_vars: dict, gallery_conf: dict) -> str:
    """Save the figures of a block, as sphinx-gallery asks for it; what shows them on the page."""
    source = Path(block_vars["src_file"])
    title = source.read_text(encoding="utf-8").splitlines()[1]
    lines = []
    for number in plt.get_fignums():
        path = Path(next(block_vars["image_path_iterator"]))
        save_twins(plt.figure(number), path)
        if not lines:
            thumb = path.parent / "thumb" / f"sphx_glr_{source.stem}_thumb.png"
            thumb.parent.mkdir(exist_ok=True)
            scale_image(twin(path), twin(thumb), *gallery_conf["thumbnail_size"])
        place = path.relative_to(gallery_conf["src_dir"]).as_posix()
        lines += [f"   .. image:: /{place}", f"      :alt: {title}", ""]
    plt.close("all")
    return "\n".join([".. container:: pictures", "", *lines]) if lines else ""


class Twins(SphinxTransform):
    """Show a picture on light pages only if there is one for dark pages, and that there."""

    default_priority = 200

    def apply(self, **options) -> None:
        """Put the twin behind each picture that has one."""
        for image in list(self.document.findall(nodes.image)):
            name = Path(image["uri"])
            if not twin(Path(self.env.relfn2path(str(name))[1])).exists():
                continue
            dark = image.deepcopy()
            dark["uri"] = str(twin(name))
            image["classes"].append("only-light")
            dark["classes"].append("only-dark")
            image.parent.insert(image.parent.index(image) + 1, dark)


def setup(app) -> dict:
    """Pair pictures when pages are read."""
    app.add_transform(Twins)
    app.add_css_file("gallery.css")
    return {"parallel_read_safe": True, "parallel_write_safe": True}
