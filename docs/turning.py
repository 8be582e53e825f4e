"""Scenes that a reader turns with the mouse: pages of their own, drawn by vtk.js within them."""

import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pyvista

#: points of a surface up to which it is kept as it is
MOST = 8000
#: where the viewer would look for icons
ICONS = "https://kitware.github.io/vtk-js/icon/"


def write_scene(plotter: pyvista.Plotter, path: Path, title: str) -> None:
    """Write a scene as a page that needs no server and no other file."""
    from trame_vtk.tools.vtksz2html import write_html

    for actor in plotter.actors.values():
        if isinstance(actor.mapper.dataset, pyvista.PolyData):
            actor.mapper.dataset = lighter(actor.mapper.dataset)
    page = io.StringIO()
    write_html(packed(plotter), page)
    head, _, body = page.getvalue().replace(ICONS, "data:,").partition("<title>")
    text = f"{head}<title>{title}{body[body.index('</title>') :]}"
    path.write_text(text, encoding="utf-8")


def lighter(mesh: pyvista.PolyData) -> pyvista.PolyData:
    """A surface without points that no face has, with fewer of the others, in single precision."""
    mesh = mesh.clean()
    if mesh.n_points > MOST:
        mesh = mesh.decimate_pro(
            1 - MOST / mesh.n_points, preserve_topology=True, boundary_vertex_deletion=False
        ).compute_normals(split_vertices=False, cell_normals=False)
    mesh.points = mesh.points.astype(np.float32)
    for name, values in mesh.point_data.items():
        mesh.point_data[name] = values.astype(np.float32)
    return mesh


def packed(plotter: pyvista.Plotter) -> bytes:
    """The scene as vtk.js reads it."""
    from trame_vtk.modules.vtk.serializers import (
        SynchronizationContext,
        extract_array_hash,
        initialize_serializers,
        reference_id,
        serialize,
    )

    initialize_serializers()
    context = SynchronizationContext()
    context.set_ignore_last_dependencies(True)  # all of it, not what changed
    window, camera = plotter.render_window, plotter.camera
    scene = serialize(None, window, reference_id(window), context, 1)
    scene["extra"] = {
        "vtkRefId": reference_id(window),
        "centerOfRotation": camera.GetFocalPoint(),
        "camera": reference_id(camera),
    }
    arrays = {
        entry["hash"]: entry | {"content": context.get_cached_data_array(entry["hash"], False)}
        for entry in extract_array_hash(scene)
    }
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("index.json", json.dumps({"hashes": arrays, "scene": scene}))
    return buffer.getvalue()
