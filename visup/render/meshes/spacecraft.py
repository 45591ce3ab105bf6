"""The spacecraft of the demo, built in code, and the list of all meshes by name.

Sizes are in metres. SPARTAN-201 measures 1.8 x 2.3 x 3.1 m and carries an instrument of 0.43 x 3 m.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path

from visup.agent.model.errors import SettingsError
from visup.render.meshes.distractors import DISTRACTORS
from visup.render.meshes.machines import MACHINES
from visup.render.meshes.solids import GREY, Colour, Solid, ball, box, cone, from_trimesh, join

WHITE: Colour = (0.80, 0.80, 0.78)
FOIL: Colour = (0.62, 0.60, 0.52)
BLACK: Colour = (0.08, 0.08, 0.09)
STEEL: Colour = (0.45, 0.46, 0.48)


def spartan() -> Solid:
    """The SPARTAN-201 satellite: 3.1 m tall on a base of 2.3 (x) by 1.8 m (y); origin in the bus.

    The instrument, 0.43 m thick and 3 m long, lies along x on top; its wider hood looks towards +x.
    The grapple fixture stands out below the hood, also towards +x.
    """
    instrument = join(
        cone((-1.5, 0, 0.85), (1.1, 0, 0.85), 0.215, None, WHITE),
        cone((1.1, 0, 0.85), (1.5, 0, 0.85), 0.30, None, WHITE),
        cone((1.5, 0, 0.85), (1.505, 0, 0.85), 0.22, None, BLACK),
        cone((-1.5, 0, 0.85), (-1.38, 0, 0.85), 0.25, None, STEEL),
    )
    bus = join(
        box((1.7, 1.5, 1.3), (0, 0, 0.05), FOIL),
        box((0.5, 1.62, 0.9), (-0.45, 0, 0.1), WHITE),
        box((0.5, 0.05, 0.6), (0.45, 0.76, 0.1), BLACK),
        box((0.5, 0.05, 0.6), (0.45, -0.76, 0.1), BLACK),
        cone((0.84, 0.2, 0.15), (0.90, 0.2, 0.15), 0.33, None, BLACK),
        box((0.12, 0.3, 0.3), (0.86, -0.5, -0.2), STEEL),
    )
    base = join(
        box((2.3, 1.8, 0.16), (0, 0, -0.68), WHITE),
        box((1.5, 1.2, 0.3), (0, 0, -0.9), STEEL),
        cone((0, 0, -1.0), (0, 0, -1.25), 0.45, 0.3, STEEL),
    )
    antenna = join(
        cone((-0.5, 0.3, 0.6), (-0.5, 0.3, 1.74), 0.03, None, STEEL),
        ball(0.07, (-0.5, 0.3, 1.78), WHITE),
    )
    grapple = join(
        box((0.3, 0.3, 0.1), (0.95, 0, -0.45), STEEL),
        cone((0.95, 0, -0.45), (1.3, 0, -0.45), 0.05, None, STEEL),
        ball(0.09, (1.3, 0, -0.45), BLACK),
    )
    return join(instrument, bus, base, antenna, grapple)


def payload_bay() -> Solid:
    """The orbiter's payload bay: floor, side walls, two sills with latches; x forward, z up, metres."""
    sills = [
        join(
            cone((-9, side * 2.3, 0), (9, side * 2.3, 0), 0.14, None, WHITE),
            box((18, 0.12, 1.6), (0, side * 2.4, -0.8), FOIL),
            *(
                box((0.25, 0.3, 0.3), (x, side * 2.3, 0.12), STEEL)
                for x in (-7.0, -4.0, -1.0, 2.0, 5.0)
            ),
        )
        for side in (-1, 1)
    ]
    ribs = [box((0.12, 4.6, 0.2), (x, 0, -1.5), STEEL) for x in (-8.0, -5.0, -2.0, 1.0, 4.0, 7.0)]
    return join(box((18, 4.7, 0.1), (0, 0, -1.65), WHITE), *sills, *ribs)


def sill() -> Solid:
    """A length of one sill of the payload bay: a tube along x with latches; origin at its near end."""
    return join(
        cone((0, 0, 0), (6.5, 0, 0), 0.10, None, WHITE),
        box((6.5, 0.06, 0.6), (3.25, 0, -0.35), FOIL),
        *(box((0.2, 0.22, 0.2), (x, 0, 0.1), STEEL) for x in (0.6, 2.6, 4.6, 6.3)),
    )


def slab() -> Solid:
    """A floor or wall: 40 by 40 m, 0.2 m thick; origin in the middle of its upper face (+z)."""
    return box((40, 40, 0.2), (0, 0, -0.1), GREY)


MESHES: dict[str, Callable[[], Solid]] = {
    "spartan": spartan,
    "payload_bay": payload_bay,
    "sill": sill,
    "slab": slab,
    **DISTRACTORS,
    **MACHINES,
}
"""Every mesh built in code that stands still in itself; the arm is in `arm.py`."""


@cache
def mesh(name: str) -> Solid:
    """A mesh by its name, or from a file.

    Args:
        name: One of `MESHES`, or the path of a PLY, STL, OBJ or OFF file.

    Returns:
        The solid; one built in code is in metres where its original has a size.

    Raises:
        SettingsError: There is no such mesh, or the file has none.
    """
    if name in MESHES:
        return MESHES[name]()
    if Path(name).suffix.lower() not in {".ply", ".stl", ".obj", ".off"}:
        raise SettingsError(
            f"there is no mesh {name!r}",
            expected=f"arm, {', '.join(sorted(MESHES))}, or a mesh file",
        )
    return read_mesh(Path(name))


def write_meshes(names: Iterable[str], folder: Path) -> list[Path]:
    """Write meshes that are built in code as PLY files.

    Args:
        names: Of `MESHES`.
        folder: Where; it must exist.

    Returns:
        The files, named as their meshes.
    """
    import trimesh

    files = []
    for name in names:
        solid = mesh(name)
        files.append(folder / f"{name}.ply")
        trimesh.Trimesh(solid.vertices, solid.faces, process=False).export(files[-1])
    return files


def read_mesh(path: Path) -> Solid:
    """The solid in a mesh file. Raises SettingsError when there is none."""
    import trimesh

    try:
        loaded = trimesh.load_mesh(path)
        solid = from_trimesh(loaded)
    except Exception as error:  # the exceptions of mesh readers depend on the format
        raise SettingsError(
            f"the mesh cannot be read: {error}",
            where=str(path),
            expected="a PLY, STL, OBJ or OFF file",
        ) from error
    if len(solid.faces) == 0:
        raise SettingsError("the mesh has no faces", where=str(path))
    return solid
