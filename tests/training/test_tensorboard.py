from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.plugins.hparams.plugin_data_pb2 import HParamsPluginData

from ffd_lightning.evaluation.protocols import Metric, ProtocolDescription
from ffd_lightning.training.tensorboard import StepLogger


def test_results_come_with_the_settings_that_tell_runs_apart(tmp_path):
    measures = (Metric("chamfer", "a distance"), Metric("iou", "of voxels", True, 100.0))
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
