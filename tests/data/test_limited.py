import pickle

import numpy as np
import pytest
from box_source import BoxSource, prepare_boxes

from ffd_lightning.data.sources.base import Source, Survey
from ffd_lightning.data.sources.limited import LimitedSource
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.errors import ConfigError, DataError


@pytest.mark.parametrize("limit", [1, 3, 7, 10, 25])
def test_ids_are_spread_evenly(limit):
    whole = ProceduralSource(10).shape_ids("table")
    ids = LimitedSource(ProceduralSource(10), limit).shape_ids("table")
    assert len(ids) == min(limit, 10)
    assert ids == sorted(set(ids))
    places = [whole.index(i) for i in ids]
    gaps = np.diff([*places, 10])
    assert places[0] == 0
    assert gaps.max() - gaps.min() <= 1


def test_all_else_is_that_of_the_whole(monkeypatch):
    whole = ProceduralSource(10)
    monkeypatch.setattr(ProceduralSource, "split", lambda *_: {"table-000000": "val"})
    limited = LimitedSource(whole, 3)
    assert isinstance(limited, Source)
    assert limited.categories() == whole.categories()
    assert limited.split("table") == {"table-000000": "val"}
    for shape_id in limited.shape_ids("table"):
        ours, theirs = (s.load("table", shape_id).mesh for s in (limited, whole))
        np.testing.assert_array_equal(ours.vertices, theirs.vertices)
    with pytest.raises(DataError):
        limited.shape_ids("unicorn")


def test_faults_are_those_of_the_shapes_that_are_taken(monkeypatch):
    faults = {"table-000000": "empty", "table-000001": "empty"}
    monkeypatch.setattr(ProceduralSource, "survey", lambda *_: Survey("v1", faults, ("note",)))
    found = LimitedSource(ProceduralSource(10), 3).survey("table")
    assert found == Survey("v1", {"table-000000": "empty"}, ("note",))


def test_nothing_is_no_limit():
    for build in (ProceduralSource, lambda count: LimitedSource(ProceduralSource(3), count)):
        with pytest.raises(ConfigError, match="=0 must be 1 or more"):
            build(0)


def test_limits_and_wholes_have_sets_of_their_own():
    sources = [
        ProceduralSource(10),
        *(LimitedSource(ProceduralSource(count), k) for count in (10, 20) for k in (3, 4)),
    ]
    facts = {str(source.fingerprint("table")) for source in sources}
    assert len(facts) == len(sources)


def test_worker_processes_prepare_what_is_left(tmp_path):
    limited = LimitedSource(BoxSource(8, tmp_path / "log"), 3)
    assert pickle.loads(pickle.dumps(limited)) == limited
    assert prepare_boxes(limited, tmp_path).ids == ("b00", "b02", "b05")
