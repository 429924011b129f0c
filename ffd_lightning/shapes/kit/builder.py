"""Primitives, collected into one mesh with part labels and materials."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.shapes.kit.materials import Material
from ffd_lightning.shapes.kit.sections import corner_arcs
from ffd_lightning.shapes.kit.vectors import UNTURNED, Array

_SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
_QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@dataclass
class Builder:
    """Collects primitives into one Mesh.

    Units are free (the mesh is normalised later); y is up, the front is -z. Every primitive
    takes the name of its part and its material first; `turn` (3, 3) rotates it about its centre.
    """

    _vertices: list[Array] = field(default_factory=list)
    _faces: list[NDArray[np.int64]] = field(default_factory=list)
    _looks: list[tuple[str, Material]] = field(default_factory=list)
    _count: int = 0

    def add(self, part: str, material: Material, vertices: ArrayLike, faces: ArrayLike) -> None:
        """Add raw triangles, vertices (v, 3), faces (f, 3); those without area are left out."""
        v = np.asarray(vertices, float).reshape(-1, 3)
        f = np.asarray(faces, np.int64).reshape(-1, 3)
        a, b, c = (v[f[:, i]] for i in range(3))
        doubled = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        f = f[doubled > 1e-12 * max(float(np.ptp(v, axis=0).max()), 1e-12) ** 2]
        self._vertices.append(v)
        self._faces.append(f + self._count)
        self._looks.append((part, material))
        self._count += len(v)

    def box(
        self,
        part: str,
        material: Material,
        center: ArrayLike,
        size: ArrayLike,
        *,
        turn: Array = UNTURNED,
        taper: float = 1.0,
    ) -> None:
        """Add a box; `taper` scales its top."""
        corners = _SIGNS * np.asarray(size, float) / 2
        corners[_SIGNS[:, 1] > 0] *= np.array([taper, 1, taper])
        faces = [t for a, b, c, d in _QUADS for t in ((a, b, c), (a, c, d))]
        self.add(part, material, corners @ turn.T + np.asarray(center, float), faces)

    def rounded_box(
        self,
        part: str,
        material: Material,
        center: ArrayLike,
        size: ArrayLike,
        radius: float,
        *,
        edge: float | None = None,
        turn: Array = UNTURNED,
        segments: int = 3,
    ) -> None:
        """Add a box whose upright edges have `radius` and whose top and bottom edges have `edge`.

        Both are shrunk to what fits; `edge` defaults to 0.8 `radius` and stays below 0.9 of it.
        """
        half = np.asarray(size, float) / 2
        corner = min(radius, 0.98 * half[0], 0.98 * half[2])
        rim = min(0.8 * corner if edge is None else edge, 0.9 * corner, 0.98 * half[1])
        quarter = np.linspace(0, np.pi / 2, segments + 1)
        corners, arcs = corner_arcs(segments)
        inset, rise = rim * (1 - np.cos(quarter)), half[1] - rim + rim * np.sin(quarter)
        rows = [*zip(inset[::-1], -rise[::-1], strict=True), *zip(inset, rise, strict=True)]
        rings = []
        for shrink, y in rows:
            flat = corners * (half[[0, 2]] - corner) + (corner - shrink) * arcs
            rings.append(np.insert(flat, 1, y, axis=1) @ turn.T + np.asarray(center, float))
        self.loft(part, material, rings)

    def loft(
        self, part: str, material: Material, sections: Sequence[ArrayLike], caps: bool = True
    ) -> None:
        """Join closed rings of points, each (k, 3) with the same k, into a skin.

        `caps` closes both ends (fans about the rings' means, so rings should be star-shaped).
        """
        rings = np.stack([np.asarray(s, float) for s in sections])
        n, k = rings.shape[:2]
        vertices, faces = rings.reshape(-1, 3), []
        for i in range(n - 1):
            for j in range(k):
                a, b = i * k + j, i * k + (j + 1) % k
                faces += [(a, b, b + k), (a, b + k, a + k)]
        for row in (0, n - 1) if caps else ():
            c, vertices = len(vertices), np.concatenate([vertices, rings[row].mean(0)[None]])
            rim = [(row * k + j, row * k + (j + 1) % k) for j in range(k)]
            faces += [(c, after, one) if row == 0 else (c, one, after) for one, after in rim]
        self.add(part, material, vertices, faces)

    def tube(
        self, part: str, material: Material, path: ArrayLike, radius: ArrayLike, segments: int = 12
    ) -> None:
        """Sweep a circle along a polyline (p, 3); `radius` may vary along it."""
        points = np.asarray(path, float)
        radii = np.broadcast_to(np.asarray(radius, float), len(points))
        tangents = [t / max(float(np.linalg.norm(t)), 1e-12) for t in np.gradient(points, axis=0)]
        angles = 2 * np.pi * np.arange(segments) / segments
        a = np.cross((0.0, 0, 1) if abs(tangents[0][2]) < 0.9 else (1.0, 0, 0), tangents[0])
        a /= np.linalg.norm(a)
        rings = []
        for point, d, r in zip(points, tangents, radii, strict=True):
            a = a - d * (a @ d)
            a /= max(np.linalg.norm(a), 1e-12)
            b = np.cross(d, a)
            rings.append(point + r * (np.cos(angles)[:, None] * a + np.sin(angles)[:, None] * b))
        self.loft(part, material, rings)

    def cylinder(
        self,
        part: str,
        material: Material,
        start: ArrayLike,
        end: ArrayLike,
        radius: float,
        *,
        radius_end: float | None = None,
        segments: int = 20,
    ) -> None:
        """Add a cylinder or truncated cone from `start` to `end`."""
        radii = (radius, radius if radius_end is None else radius_end)
        self.tube(part, material, np.stack([start, end]), radii, segments=segments)

    def lathe(
        self,
        part: str,
        material: Material,
        profile: ArrayLike,
        center: ArrayLike = (0, 0, 0),
        *,
        segments: int = 28,
        turn: Array = UNTURNED,
        squash: float = 1.0,
    ) -> None:
        """Turn a profile of (radius, height) rows, (p, 2), about y; `squash` scales z."""
        angles = 2 * np.pi * np.arange(segments) / segments
        circle = np.stack([np.cos(angles), np.zeros(segments), -squash * np.sin(angles)], 1)
        rings = [
            (r * circle + np.array([0, h, 0])) @ turn.T + np.asarray(center, float)
            for r, h in np.asarray(profile, float)
        ]
        self.loft(part, material, rings)

    def ellipsoid(
        self,
        part: str,
        material: Material,
        center: ArrayLike,
        radii: ArrayLike,
        *,
        segments: int = 20,
        turn: Array = UNTURNED,
    ) -> None:
        """Add an axis-aligned (or turned) ellipsoid."""
        rx, ry, rz = np.asarray(radii, float)
        a = np.linspace(-np.pi / 2, np.pi / 2, segments // 2 + 1)
        profile = np.stack([rx * np.cos(a), ry * np.sin(a)], 1)
        self.lathe(part, material, profile, center, segments=segments, turn=turn, squash=rz / rx)

    def mesh(self) -> Mesh:
        """Return everything added so far as one mesh, textures mapped by the box projection."""
        vertices, faces = np.concatenate(self._vertices), np.concatenate(self._faces)
        counts = [len(f) for f in self._faces]
        parts, materials = zip(*self._looks, strict=True)
        names = tuple(dict.fromkeys(parts))
        patterned = list(dict.fromkeys(m for m in materials if m.pattern))
        textures = [patterned.index(m) if m.pattern else -1 for m in materials]
        scale = np.repeat([m.scale for m in materials], counts)
        return Mesh(
            vertices=vertices,
            faces=faces,
            face_colors=np.repeat([m.rgba() for m in materials], counts, axis=0),
            face_parts=np.repeat(np.array([names.index(p) for p in parts], np.uint8), counts),
            part_names=names,
            textures=tuple(m.texture() for m in patterned),
            face_textures=np.repeat(np.array(textures, np.int16), counts) if patterned else None,
            face_uvs=_box_projection(vertices[faces], scale) if patterned else None,
        )


def _box_projection(corners: Array, scale: Array) -> NDArray[np.float32]:
    """Project each face (f, 3, 3) along its dominant axis; u runs along the longer world axis."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    kept = np.array([(2, 1), (0, 2), (0, 1)])[np.abs(normals).argmax(1)]
    uv = np.take_along_axis(corners, kept[:, None], 2)
    return (uv * scale[:, None, None]).astype(np.float32)
