"""Write solids as STL, 3MF and STEP, in mm.

The same solid gives the same bytes. STEP is faceted: it has the flat triangles of the mesh in place
of cylinders, so CAD programs can measure and cut a solid but cannot edit its holes.
"""

import io
import struct
import zipfile

import numpy as np
from numpy.typing import NDArray

from miburi.hardware.solids import Manifold
from miburi.robot.description import Array

#: An empty text in a STEP file.
_EMPTY = "''"
_3MF = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType='
    '"application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType='
    '"application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    "</Types>"
)
_RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?>'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)


def triangles(solid: Manifold) -> tuple[Array, NDArray[np.int64]]:
    """Return the corners of a solid, in mm, and its triangles, as indices of corners.

    The arrays have shapes (n, 3) and (m, 3). Corners are rounded to 0.1 µm. Corners that
    coincide are merged, and triangles that this leaves without an area are dropped.
    """
    mesh = solid.to_mesh64()
    rounded = np.round(np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3], 4)
    corners, number = np.unique(rounded, axis=0, return_inverse=True)
    faces = number.reshape(-1)[np.asarray(mesh.tri_verts, dtype=np.int64)]
    a, b, c = faces.T
    return corners, faces[(a != b) & (b != c) & (c != a)]


def stl(solid: Manifold) -> bytes:
    """Return a solid as binary STL."""
    corners, faces = triangles(solid)
    points = corners[faces].astype("<f4")
    normals = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    rows = np.zeros(len(faces), dtype=[("v", "<f4", (4, 3)), ("spare", "<u2")])
    rows["v"][:, 0], rows["v"][:, 1:] = normals, points
    return b"\0" * 80 + struct.pack("<I", len(faces)) + rows.tobytes()


def three_mf(solid: Manifold, name: str) -> bytes:
    """Return a solid as 3MF."""
    corners, faces = triangles(solid)
    vertices = "".join(f'<vertex x="{x:.5f}" y="{y:.5f}" z="{z:.5f}"/>' for x, y, z in corners)
    sides = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in faces)
    model = (
        f'<?xml version="1.0" encoding="UTF-8"?><model unit="millimeter" xmlns="{_3MF}">'
        f'<resources><object id="1" name="{name}" type="model"><mesh><vertices>{vertices}'
        f"</vertices><triangles>{sides}</triangles></mesh></object></resources>"
        '<build><item objectid="1"/></build></model>'
    )
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        files = {
            "[Content_Types].xml": _TYPES, "_rels/.rels": _RELATIONS, "3D/3dmodel.model": model,
        }  # fmt: skip
        for path, text in files.items():
            # A fixed date: the same part gives the same bytes.
            entry = zipfile.ZipInfo(path, (2026, 1, 1, 0, 0, 0))
            archive.writestr(entry, text, zipfile.ZIP_DEFLATED)
    return held.getvalue()


def step(solid: Manifold, name: str) -> bytes:
    """Return a solid as STEP (AP214), one flat face for each triangle."""
    corners, faces = triangles(solid)
    lines: list[str] = []

    def add(text: str) -> str:
        lines.append(f"#{len(lines) + 1}={text};")
        return f"#{len(lines)}"

    def direction(values: Array) -> str:
        return add(f"DIRECTION('',({_numbers(values)}))")

    context = add("APPLICATION_CONTEXT('automotive design')")
    add(
        "APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,"
        f"{context})"
    )
    product = add(
        f"PRODUCT('{name}','{name}','',({add(f'PRODUCT_CONTEXT({_EMPTY},{context},{_EMPTY})')}))"
    )
    formation = add(f"PRODUCT_DEFINITION_FORMATION('','',{product})")
    design = add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{context},'design')")
    shape = add(
        f"PRODUCT_DEFINITION_SHAPE('','',{add(f'PRODUCT_DEFINITION({_EMPTY},{_EMPTY},{formation},{design})')})"
    )
    length = add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
    angle = add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
    solid_angle = add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
    precision = add(
        f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-4),{length},'distance_accuracy_value','')"
    )
    units = add(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((" + precision
        + f"))GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid_angle}))"
        "REPRESENTATION_CONTEXT('',''))"
    )  # fmt: skip
    points = [add(f"CARTESIAN_POINT('',({_numbers(corner)}))") for corner in corners]
    vertices = [add(f"VERTEX_POINT('',{point})") for point in points]
    edges: dict[tuple[int, int], str] = {}
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    for a, b in np.unique(np.sort(pairs, axis=1), axis=0).tolist():  # each edge once
        way = corners[b] - corners[a]
        along = float(np.linalg.norm(way))
        line = add(f"LINE('',{points[a]},{add(f'VECTOR({_EMPTY},{direction(way / along)},1.)')})")
        edges[a, b] = add(f"EDGE_CURVE('',{vertices[a]},{vertices[b]},{line},.T.)")
    sides = []
    for face in faces.tolist():
        x, y, z = corners[face]
        normal = np.cross(y - x, z - x)
        normal /= np.linalg.norm(normal)
        place = add(
            f"AXIS2_PLACEMENT_3D('',{points[face[0]]},{direction(normal)},"
            f"{direction((y - x) / np.linalg.norm(y - x))})"
        )
        loop = ",".join(
            add(
                f"ORIENTED_EDGE('',*,*,{edges[min(pair), max(pair)]},"
                f"{'.T.' if pair[0] < pair[1] else '.F.'})"
            )
            for pair in zip(face, face[1:] + face[:1], strict=True)
        )
        bound = add(f"FACE_OUTER_BOUND('',{add(f'EDGE_LOOP({_EMPTY},({loop}))')},.T.)")
        sides.append(add(f"ADVANCED_FACE('',({bound}),{add(f'PLANE({_EMPTY},{place})')},.T.)"))
    closed = add(f"CLOSED_SHELL('',({','.join(sides)}))")
    brep = add(f"MANIFOLD_SOLID_BREP('{name}',{closed})")
    drawn = add(f"ADVANCED_BREP_SHAPE_REPRESENTATION('{name}',({brep}),{units})")
    add(f"SHAPE_DEFINITION_REPRESENTATION({shape},{drawn})")
    header = (
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(('faceted solid'),'2;1');\n"
        f"FILE_NAME('{name}.step','2026-01-01T00:00:00',(''),(''),'miburi','miburi','');\n"
        "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));\nENDSEC;\nDATA;\n"
    )
    return (header + "\n".join(lines) + "\nENDSEC;\nEND-ISO-10303-21;\n").encode("ascii")


def _numbers(values: Array) -> str:
    return ",".join(f"{value:.6f}" for value in values)


#: The formats in which a part can be written.
FORMATS = ("3mf", "stl", "step")


def encode(solid: Manifold, name: str, ending: str) -> bytes:
    """Return a solid as the contents of a file; ``ending`` is one of :data:`FORMATS`."""
    makers = {"3mf": three_mf, "stl": lambda solid, _: stl(solid), "step": step}
    return makers[ending](solid, name)
