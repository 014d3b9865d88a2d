"""Pictures: PNG without a screen; windows and notebooks, by PyVista."""

from __future__ import annotations

import base64
import html
import importlib.util
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from . import _medial
from ._arguments import Progress, call, need, path_text, real, whole
from .errors import InputError, MedialError, ParameterError
from .mesh import Mesh

if TYPE_CHECKING:
    from .axis import MedialAxis

Backend = Literal["pyvista", "png"]


@dataclass(frozen=True)
class Picture:
    """A picture, which a notebook shows."""

    png: bytes = field(repr=False)
    """The content of a PNG file."""
    width: int
    """Pixels."""
    height: int
    """Pixels."""
    direction: tuple[float, float, float]
    """From the shape to the eye."""
    up: tuple[float, float, float]
    errors: tuple[Mapping[str, float | None], ...] = field(hash=False)
    """For each drawn reconstruction: `max` and `mean` of the drawn errors, and `hausdorff` as in `evaluate`; fractions of
    the bounding-box diagonal."""

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the PNG file.

        Args:
            path: The file.

        Raises:
            OSError: It cannot be written.

        Example:
            >>> from medial_axis import Mesh, render
            >>> render(Mesh.read("builtin:box")).save("box.png")
        """
        Path(path_text(path)).write_bytes(self.png)

    def _repr_png_(self) -> bytes:
        return self.png


def render(
    mesh: Mesh | MedialAxis,
    axes: MedialAxis | Iterable[MedialAxis] = (),
    *,
    show: Literal["surface", "axis", "structure", "reconstruction", "error"] | None = None,
    color: Literal["radius", "plain"] = "radius",
    camera: str | Sequence[float] | None = None,
    up: str | Sequence[float] | None = None,
    size: tuple[int, int] = (800, 600),
    background: str = "white",
    max_error: float | None = None,
    tolerance: float = 0.02,
    names: Sequence[str] | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Picture:
    """Draws a surface and medial meshes of it, without GPU or display.

    Args:
        mesh: The surface; or a medial mesh, which is drawn in its surface.
        axes: Medial meshes of it. Several give a strip: a panel for each, from the same camera.
        show: Content of the picture; by default `axis`, or `surface` without a medial mesh. `error` is the reconstruction,
            coloured by its distance to the surface.
        color: Colours of a medial mesh: by `radius`, or `plain` with one colour for sheets and one for curves.
        camera: `front`, `back`, `left`, `right`, `top`, `bottom`, `iso`; azimuth and elevation in degrees; or the direction
            from the shape to the eye. By default the direction that shows most of the shape.
        up: `x`, `y`, `z`, `-x`, `-y`, `-z`, or a direction.
        size: Width and height of each panel, in pixels.
        background: `white`, `black`, `transparent` or `#rrggbb`.
        max_error: End of the scale of errors, a fraction of the diagonal.
        tolerance: Largest distance of a drawn reconstruction from the boundary of the union, a fraction of the diagonal.
        names: Captions of a strip, one for each medial mesh; by default the method.
        threads: Threads of a separate pool; by default all calls share one.
        progress: Called with a stage and its completed share.

    Returns:
        The picture. A notebook shows it; `.save` writes it.

    Raises:
        ParameterError: An option is wrong.
        InputError: A reconstruction cannot be made, or a medial mesh has no surface.

    Example:
        >>> from medial_axis import Mesh, render
        >>> axis = Mesh.read("builtin:box").medial_axis()
        >>> picture = render(axis, show="error", size=(320, 240))
        >>> picture.width, picture.height, picture.png[1:4]
        (320, 240, b'PNG')
    """
    from .axis import MedialAxis

    drawn = [axes] if isinstance(axes, MedialAxis) else list(axes)
    if isinstance(mesh, MedialAxis):
        drawn.insert(0, mesh)
        if mesh.mesh is None:
            raise InputError("render: this medial axis has no surface; read it by Mesh.read_axis")
        mesh = mesh.mesh
    if not isinstance(mesh, Mesh) or not all(isinstance(axis, MedialAxis) for axis in drawn):
        raise InputError("render: expected a Mesh and MedialAxis objects")
    mesh._solid()
    captions = [_caption(axis) for axis in drawn] if names is None else [str(name) for name in names]
    if len(captions) != len(drawn):
        raise ParameterError(f"names: wrong number (found {len(captions)}, expected {len(drawn)})")
    try:
        width, height = size
    except (TypeError, ValueError):
        raise ParameterError(f"size: expected a width and a height, found {size!r}") from None
    options = {
        "show": show,
        "color": str(color),
        "camera": None if camera is None else _word(camera),
        "up": None if up is None else _word(up),
        "size": [whole(side, "size", 0, 2**32 - 1) for side in (width, height)],
        "background": background,
        "max_error": None if max_error is None else real(max_error, "max_error"),
        "tolerance": real(tolerance, "tolerance"),
    }
    layers = [(name, axis._axis) for name, axis in zip(captions, drawn)]
    png, facts = _medial.render(mesh._surface, layers, json.dumps(options), call(0, threads, progress))
    drawn_as = json.loads(facts)
    direction, up, errors = (tuple(drawn_as[key]) for key in ("direction", "up", "errors"))
    return Picture(png, drawn_as["width"], drawn_as["height"], direction, up, errors)


def _word(value: Any) -> str:
    return value if isinstance(value, str) else ",".join(map(str, value)) if isinstance(value, Iterable) else str(value)


def _caption(axis: MedialAxis) -> str:
    return "medial axis" if axis.run is None else axis.run.method


def plot(what: Mesh | MedialAxis, backend: Backend | None, screenshot: str | os.PathLike[str] | None) -> Any:
    """A window, or a cell of a notebook, of PyVista; else a `Picture`."""
    if backend not in (None, "pyvista", "png"):
        raise ParameterError(f"backend: expected pyvista or png, found {backend!r}")
    if backend == "png" or (backend is None and importlib.util.find_spec("pyvista") is None):
        picture = render(what)
        if screenshot is not None:
            picture.save(screenshot)
        return picture
    plotter = need("pyvista", "PyVista").Plotter(off_screen=screenshot is not None)
    surface = what if isinstance(what, Mesh) else what.mesh
    if surface is not None:
        plotter.add_mesh(surface.to_pyvista(), color="white", opacity=1.0 if surface is what else 0.15)
    if surface is not what:
        look = {"line_width": 3, "show_edges": True, "edge_color": "gray", "scalar_bar_args": {"vertical": True}}
        plotter.add_mesh(what.to_pyvista(), scalars="radius", **look)
    if surface is not None and surface.problem is None:
        # The same side as on other pictures.
        view = render(surface, size=(32, 32))
        plotter.view_vector(view.direction, viewup=view.up)
    return plotter.show(screenshot=False if screenshot is None else path_text(screenshot))


def small_png(what: Mesh | MedialAxis) -> bytes | None:
    """The picture of an object in a notebook; None where it cannot be drawn, such as a medial mesh without a surface."""
    try:
        return render(what, size=(480, 360)).png
    except MedialError:
        return None


def to_html(png: bytes | None, rows: Mapping[str, object]) -> str:
    """A picture and a table."""
    cells = (
        f"<tr><th style='text-align:left'>{html.escape(name)}</th>"
        f"<td style='text-align:left'>{html.escape(str(value))}</td></tr>"
        for name, value in rows.items()
    )
    image = ""
    if png is not None:
        image = f"<img width='480' height='360' src='data:image/png;base64,{base64.b64encode(png).decode()}'/>"
    return f"<div>{image}<table>{''.join(cells)}</table></div>"
