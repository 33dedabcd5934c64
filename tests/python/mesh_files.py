"""Makes mesh files with Gmsh for the tests of the reader, and checks files of the writer with Gmsh and meshio.

    python3 mesh_files.py make FOLDER
    python3 mesh_files.py check FILE.msh

`make` writes second-order meshes of spheres in a cylinder, with and without Gmsh's optimiser. For each mesh it
prints the name, the number of tetrahedra, the number of folded tetrahedra and the volume of the spheres.
`check` prints the contents of the file as Gmsh and meshio read them. Needs gmsh, meshio and numpy.
"""
import sys
from math import pi
from pathlib import Path

import gmsh
import meshio
import numpy as np

RADIUS_MM, HEIGHT_MM = 2.5, 4.4
ONE = [(0.5, 0.25, 2.0, 0.9)]
CLOSE = [(0, 0, 1.2, 0.7), (0, 0, 2.65, 0.7), (1.43, 0, 1.9, 0.7), (-1.43, 0.1, 1.9, 0.68)]


def make(path, spheres, spacing_mm, optimise):
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    cylinder = gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, HEIGHT_MM, RADIUS_MM)
    balls = [gmsh.model.occ.addSphere(*sphere) for sphere in spheres]
    gmsh.model.occ.fragment([(3, cylinder)], [(3, ball) for ball in balls])
    gmsh.model.occ.synchronize()
    volumes = [tag for _, tag in gmsh.model.getEntities(3)]
    matrix = max(volumes, key=lambda tag: gmsh.model.occ.getMass(3, tag))
    gmsh.model.addPhysicalGroup(3, [matrix], 1, "matrix")
    gmsh.model.addPhysicalGroup(3, [tag for tag in volumes if tag != matrix], 2, "grain")
    for number, level in ((11, 0.0), (12, HEIGHT_MM)):
        box = [-3, -3, level - 1e-3, 3, 3, level + 1e-3]
        faces = [tag for _, tag in gmsh.model.getEntitiesInBoundingBox(*box, 2)]
        gmsh.model.addPhysicalGroup(2, faces, number)
    gmsh.option.setNumber("Mesh.MeshSizeMax", spacing_mm)
    gmsh.option.setNumber("Mesh.ElementOrder", 2)
    gmsh.option.setNumber("Mesh.HighOrderOptimize", optimise)
    gmsh.model.mesh.generate(3)
    gmsh.write(str(path))
    tets = gmsh.model.mesh.getElementsByType(11)[0]
    folded = int((gmsh.model.mesh.getElementQualities(tets, "minDetJac") <= 0).sum())
    gmsh.finalize()
    print(path.name, len(tets), folded, sum(4 / 3 * pi * r**3 for *_, r in spheres))


def check(path):
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 2)
    gmsh.open(str(path))
    kinds, tags, _ = gmsh.model.mesh.getElements(3)
    (tets,) = tags
    print("gmsh tetrahedra", len(tets))
    print("gmsh volume", gmsh.model.mesh.getElementQualities(tets, "volume").sum())
    print("gmsh views", len(gmsh.view.getTags()))
    gmsh.finalize()

    mesh = meshio.read(path)
    print("meshio blocks", len(mesh.cells))
    names = {int(number): name for name, (number, dimension) in mesh.field_data.items() if dimension == 3}
    count, grain, mixed = 0, 0.0, 0.0
    data = mesh.cell_data
    for block, groups, fraction in zip(mesh.cells, data["gmsh:physical"], data["grain_fraction"]):
        if not block.type.startswith("tetra"):
            assert not fraction.any()
            continue
        corners = mesh.points[block.data[:, :4]]
        volume = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
        count += len(volume)
        grain += sum(v for v, group in zip(volume, groups) if names[int(group)] == "grain")
        mixed += (volume * fraction.ravel()).sum()
    print("meshio tetrahedra", count)
    print("meshio grain_volume", grain)
    print("meshio mixed_volume", mixed)


if __name__ == "__main__":
    task, place = sys.argv[1], Path(sys.argv[2])
    if task == "check":
        check(place)
    else:
        make(place / "one.msh", ONE, 1.5, 0)
        make(place / "close.msh", CLOSE, 0.8, 0)
        make(place / "fine.msh", ONE, 0.6, 0)
        # the optimiser takes seconds; the smallest mesh is enough to test unfolded elements
        make(place / "optimised.msh", ONE, 1.5, 1)
