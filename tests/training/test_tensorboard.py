import numpy as np
import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.backend.event_processing.event_file_loader import EventFileLoader
from tensorboard.plugins.hparams.plugin_data_pb2 import HParamsPluginData
from tensorboard.util import tensor_util
from torch.utils.tensorboard import SummaryWriter

from ffd_lightning.evaluation.protocols import Measure, ProtocolDescription
from ffd_lightning.training.tensorboard import StepLogger, custom_scalars, write_bars


@pytest.mark.parametrize("count", [1, 2, 4, 16, 30, 45])
def test_tensorboard_shows_a_bar_at_its_template_whatever_the_others_are(tmp_path, count):
    heights = np.random.default_rng(0).integers(0, 3, count)
    with SummaryWriter(tmp_path) as writer:
        write_bars(writer, "bars", heights, 3)
    (file,) = tmp_path.glob("events.*")
    (value,) = [v for e in EventFileLoader(str(file)).Load() for v in e.summary.value]
    shown = tensor_util.make_ndarray(value.tensor)  # the loader makes it what the pages show
    left, right, found = shown.T
    assert len(shown) == max(30, count), "the buckets that TensorBoard draws"
    assert right[:-1] == pytest.approx(left[1:])
    for t, height in enumerate(heights):
        inside = (left >= t + 0.5) & (right <= t + 1.5) & (found > 1e-9)
        assert found[inside] == pytest.approx(np.full(inside.sum(), height))
        assert inside.any() == (height > 0)
        if height:
            middle = (left[inside].min() + right[inside].max()) / 2
            assert middle == pytest.approx(t + 1), "the template's number"
    if count <= 15:
        bars = np.flatnonzero(found > 1e-9)
        assert len(bars) < len(found) - count + 1, "with gaps between them"


def test_each_term_has_a_chart_of_its_own():
    pages = custom_scalars(["mean_chamfer", "lattice_folding"])
    alone = pages["terms without their weights"]
    assert alone["lattice_folding"] == ["Multiline", ["values_of_terms/lattice_folding$"]]
    assert next(iter(pages)).startswith("selection")


def test_results_come_with_the_settings_that_tell_runs_apart(tmp_path):
    measures = (Measure("chamfer", "a distance"), Measure("iou", "of voxels", True, 100.0))
    protocol = ProtocolDescription("paper", "", measures)
    summary = {"chamfer": 0.5, "undeformed_chamfer": 0.75, "iou": 0.25, "floor_chamfer": 0.1}
    logger = StepLogger(tmp_path, "", "tensorboard")
    settings = {"category": "table", "batch_size": 4, "regime": "e", "templates": 16}
    logger.log_results(settings, summary, protocol, 300)
    logger.finalize("success")
    events = EventAccumulator(str(tmp_path / "tensorboard")).Reload()
    assert events.Tags()["scalars"] == [], "they are no curves"
    content = {
        tag: HParamsPluginData.FromString(metadata.plugin_data.content)
        for tag, metadata in events.summary_metadata.items()
        if metadata.plugin_data.plugin_name == "hparams"
    }
    told = content["_hparams_/session_start_info"].session_start_info.hparams
    assert told["regime"].string_value == "e"
    assert told["batch_size"].number_value == 4
    assert told["Chamfer x 1000"].number_value == 500
    assert told["undeformed Chamfer x 1000"].number_value == 750
    assert told["IoU x 100"].number_value == 25
    infos = content["_hparams_/experiment"].experiment.hparam_infos
    first = {"category", "regime", "templates", "Chamfer x 1000", "IoU x 100"}
    assert {info.name for info in infos if info.differs} == first
    assert {info.name for info in infos} == {*told}
