"""The templates beside an exported graph: arrays that deform without torch."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from ffd_lightning.data.templates.bank import TemplateBank


def pack_templates(bank: TemplateBank) -> dict[str, Any]:
    """Return the arrays that deform a bank's subdivided meshes.

    Lattice coordinates stand for the vertices, B P, and for B itself, M / 3 times as large.

    Returns:
        `ids` (T,), `degrees` (3,), `control_points` (T, M, 3), `part_names`, and of template k's
        subdivided mesh `stu_k` (V, 3), `faces_k` (F, 3), `colors_k` (F, 4) and, where known,
        `parts_k` (F,), index into `part_names`, 255 unknown.
    """
    arrays: dict[str, Any] = {
        "ids": np.array(bank.ids),
        "degrees": np.array(bank.degrees),
        "control_points": bank.control_points.numpy(),
        "part_names": np.array(bank.part_names, np.str_),
    }
    for k, lattice in enumerate(bank.lattices):
        mesh, _ = bank.subdivided(k)
        arrays[f"stu_{k}"] = lattice.to_stu(torch.from_numpy(mesh.vertices)).float().numpy()
        arrays[f"faces_{k}"] = mesh.faces.astype(np.int32)
        arrays[f"colors_{k}"] = mesh.face_colors
        if mesh.face_parts is not None:
            arrays[f"parts_{k}"] = mesh.face_parts
    return arrays
