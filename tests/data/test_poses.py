import numpy as np
import pytest
from box_source import RENDER

from ffd_lightning import shapes
from ffd_lightning.data.preparation.overview import suggested_of
from ffd_lightning.data.preparation.poses import likely_poses
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.reading.orientation import turn
from ffd_lightning.data.sources.folder import FolderSource

COUNT = 24
TURNED = {2: ("y", 90), 7: ("y", 180), 11: ("z", 0)}  # none of them a stool


@pytest.fixture
def folder(tmp_path):
    """Chairs that face +z, some of them turned."""
    for k in range(COUNT):
        mesh, _ = shapes.build("chair", k)
        vertices = turn(turn(mesh.vertices, "y", 180), *TURNED.get(k, ("y", 0)))
        lines = ["v {:.6f} {:.6f} {:.6f}".format(*v) for v in vertices]
        lines += ["f {} {} {}".format(*face) for face in mesh.faces + 1]
        file = tmp_path / f"shapes/chair/c{k:02d}.obj"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("\n".join(lines))
    return tmp_path


def test_shapes_that_stand_otherwise_are_named_and_their_lines_mend_it(folder, capfd):
    def prepare():
        source = FolderSource(folder / "shapes", yaw=180)
        return Preparation(source, "chair", 256, RENDER, folder, variants=1, workers=2).run()

    prepared = prepare()
    found = likely_poses(prepared.originals)
    assert found == {"c02": ("y", 90), "c07": ("y", 0), "c11": ("-z", 180)}
    said = capfd.readouterr().err
    lines = said[said.index("id,yaw,up") :].split("contact sheet")[0]
    assert suggested_of(prepared.path).read_text() == lines
    (folder / "shapes/chair/orientations.csv").write_text(lines)
    mended = prepare()
    assert likely_poses(mended.originals) == {}
    upright, _ = shapes.build("chair", 11)
    middle = (upright.vertices.min(axis=0) + upright.vertices.max(axis=0)) / 2
    expected = upright.vertices - middle
    expected /= np.linalg.norm(np.ptp(upright.vertices, axis=0))
    np.testing.assert_allclose(mended.mesh(mended.index("c11")).vertices, expected, atol=1e-4)
