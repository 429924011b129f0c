import csv
import json
import shlex
import shutil
import signal
import sys
from pathlib import Path

import pytest
import torch
from commands import ROOT, SAVING, killed, python, run_command
from conftest import FEW, TINY
from lightning import Callback
from omegaconf import OmegaConf
from PIL import Image
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.plugins.hparams.plugin_data_pb2 import HParamsPluginData
from torch.utils._python_dispatch import TorchDispatchMode

from ffd_lightning import components
from ffd_lightning.analysis.results import Results, evaluate_command, own_protocol
from ffd_lightning.analysis.tables import summary_tables
from ffd_lightning.app.commands.evaluate import read_config
from ffd_lightning.app.commands.train import run_to_end
from ffd_lightning.app.open_run import open_run
from ffd_lightning.app.sweep_end import SweepEnd
from ffd_lightning.app.training_run import train
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.files import lock_folder
from ffd_lightning.run_folder import RunFolder, find_runs
from ffd_lightning.training.callbacks import Clock


def samples(run):
    return (run.evaluation(FEW) / "samples.csv").read_text()


def curves(run):
    """What TensorBoard shows: values of each step, and when pictures and clouds were drawn."""
    kinds = ("Histograms", "Images", "Tensors")
    events = EventAccumulator(str(run.path), {kind.lower(): 0 for kind in kinds}).Reload()
    tags = events.Tags()
    shown = {tag: [(e.step, e.value) for e in events.Scalars(tag)] for tag in tags["scalars"]}
    for kind in kinds:
        for tag in tags[kind.lower()]:
            name = tag.split(": ")[-1]  # clouds begin with the run's own
            shown[name] = [event.step for event in getattr(events, kind)(tag)]
    return {tag: found for tag, found in shown.items() if "per_second" not in tag}


@pytest.fixture(scope="module")
def finished(tiny_config, tmp_path_factory):
    run = RunFolder(tmp_path_factory.mktemp("run") / "a")
    return run, train(tiny_config("logger.every=1"), run)


def test_a_run_leaves_everything_that_is_read_later(finished):
    run, summary = finished
    assert run.finished
    assert run.status["summary"] == summary
    written = json.loads((run.evaluation(FEW) / "summary.json").read_text())
    assert written.items() >= {k: v for k, v in summary.items() if k != "seconds_per_step"}.items()
    opened = open_run(run).data
    split, templates = opened.split, list(opened.bank.ids)
    rows = list(csv.DictReader(samples(run).splitlines()))
    assert [r["id"] for r in rows] == list(split.test)
    ranking = list(csv.DictReader((run.path / "template_ranking.csv").open()))
    assert {r["id"] for r in ranking} == set(templates)
    assert sum(int(r["count"]) for r in ranking) == len(split.val), "chosen before the test"
    assert set(templates).isdisjoint((*split.train, *split.val, *split.test))
    assert [row["id"] for row in csv.DictReader((run.path / "templates.csv").open())] == templates
    assert run.data == {**opened.record(), "folder": str(Path.cwd())}
    assert Image.open(run.path / "reconstructions.png").size[0] > 5 * 64
    assert Image.open(run.path / "templates.png").size[0] > 2 * 256
    (row,) = Results.read(run.path).scored.to_dict("records")
    assert (row["category"], row["regime"], row["templates"]) == ("table", "b", 2)
    assert row["chamfer"] == pytest.approx(summary["chamfer"])
    again = evaluate_command(run, own_protocol(run)).removeprefix("ffd evaluate ")
    assert read_config(shlex.split(again)).protocol.settings["points"] == 64


def test_a_ranking_may_count_every_image_that_was_trained_on(tiny_config, tmp_path):
    run = RunFolder(tmp_path / "a")
    given = ["schedule.steps=2", "data.render.azimuths=[45,135]"]
    counted = ["template_ranking.subset=train", "template_ranking.all_views=true"]
    summary = train(tiny_config(*given, *counted, "evaluation.subset=val"), run)
    (row,) = Results.of([run], f"{FEW}/val").scored.to_dict("records")
    assert row["chamfer"] == pytest.approx(summary["chamfer"]), "of the validation shapes"
    assert summary_tables([run])
    opened = open_run(run)
    rows = list(csv.DictReader((run.path / "template_ranking.csv").open()))
    expected = dict.fromkeys(opened.data.bank.ids, 0)
    opened.network.eval()
    for model in opened.data.split.train:
        for view in (0, 1):
            image = opened.data.prepared.image(opened.data.prepared.index(model), view)[..., :3]
            batch = torch.from_numpy(image.copy()).permute(2, 0, 1)[None]
            expected[opened.data.bank.ids[int(opened.network(batch).template_index)]] += 1
    assert {r["id"]: int(r["count"]) for r in rows} == expected
    assert sum(expected.values()) == 2 * len(opened.data.split.train)
    with pytest.raises(ConfigError, match=r"template_ranking\.subset was train, now val"):
        train(tiny_config(*given), run)


def test_a_step_adds_up_the_gradients_of_batches_and_cuts_them_to_a_norm(tiny_config, tmp_path):
    given = ["trainer.accumulate_grad_batches=3", "optimizer=sgd", "lr_schedule=none"]
    given += ["schedule.learning_rate=1", "schedule.offset_rate=1", "schedule.steps=1"]
    found = []
    for norm in (0.1, 0.3):
        run = RunFolder(tmp_path / str(norm))
        train(tiny_config(*given, f"trainer.gradient_clip_val={norm}", "logger.every=1"), run)
        network = open_run(run).network
        found.append(torch.cat([value.flatten() for value in network.parameters()]))
    apart = torch.linalg.vector_norm((found[1] - found[0]).double())
    assert apart.item() == pytest.approx(0.2, rel=1e-3)
    events = EventAccumulator(str(run.path)).Reload()
    for tag in ("train/loss", "work/learning_rate"):
        assert [event.step for event in events.Scalars(tag)] == [1]
    assert [event.step for event in events.Histograms("which_template/selected")] == [1]


def hparams_of(events):
    """What TensorBoard's page HPARAMS says of a run."""
    metadata = events.summary_metadata["_hparams_/session_start_info"]
    content = HParamsPluginData.FromString(metadata.plugin_data.content)
    return content.session_start_info.hparams


def test_tensorboard_holds_the_settings_and_results_that_tell_runs_apart(finished):
    run, summary = finished
    events = EventAccumulator(str(run.path)).Reload()
    tags = events.Tags()
    assert {"which_template/all", "worked_examples/reconstructions"} < {*tags["images"]}
    assert "which_template/selected" in tags["histograms"]
    assert not [tag for tag in tags["scalars"] if tag.startswith("test/")], "dots, not curves"
    told = hparams_of(events)
    assert told["regime.name"].string_value == "b"
    assert told["schedule.batch_size"].number_value == 4
    assert told["Chamfer x 1000"].number_value == pytest.approx(1000 * summary["chamfer"])


def test_a_finished_run_stays_finished_when_it_cannot_be_evaluated_anew(
    tiny_config, tmp_path, monkeypatch
):
    run = RunFolder(tmp_path / "run")
    few = ("schedule.steps=2", "split.val_fraction=0")
    train(tiny_config(*few), run)
    settings, status = run.config.read_bytes(), run.status
    monkeypatch.setattr("ffd_lightning.app.training_run.evaluate", interrupted)
    with pytest.raises(KeyboardInterrupt):
        train(tiny_config(*few, "evaluation.seed=1"), run)
    with pytest.raises(ConfigError, match="no validation shapes"):
        train(tiny_config(*few, "evaluation.subset=val", "logger.every=7"), run)
    assert run.status == status, "nor is it called running after a kill"
    assert run.config.read_bytes() == settings, "it says how the run was trained"


def test_a_training_that_a_callback_ended_goes_on_no_more(tiny_config, tmp_path, monkeypatch):
    run, settings = RunFolder(tmp_path / "run"), ("schedule.steps=9", "callback=[stops]")
    monkeypatch.setitem(components._registered, ("callback", "stops"), (StopsAtTwo, "mine"))
    train(tiny_config(*settings), run)
    weights = torch.load(run.checkpoint, weights_only=True)["state_dict"]
    train(tiny_config(*settings, "evaluation.seed=1"), run)
    again = torch.load(run.checkpoint, weights_only=True)
    assert again["global_step"] == 2
    assert all(torch.equal(weights[name], again["state_dict"][name]) for name in weights)


class StopsAtTwo(Callback):
    def on_train_batch_end(self, trainer, *_):
        trainer.should_stop = trainer.global_step == 2


def interrupted(*_):
    raise KeyboardInterrupt


def test_a_restart_discards_all_that_was_found_out_about_the_network(
    finished, tiny_config, tmp_path, monkeypatch
):
    run = RunFolder(shutil.copytree(finished[0].path, tmp_path / "run"))
    shutil.copytree(run.evaluation(FEW), run.evaluation("modern", "val"))
    with lock_folder(run.evaluation(FEW), ""), pytest.raises(ConfigError, match="evaluates"):
        train(tiny_config("restart=true"), run)
    assert run.finished
    monkeypatch.setattr("ffd_lightning.app.training_run._train", interrupted)
    with pytest.raises(KeyboardInterrupt):
        train(tiny_config("restart=true"), run)
    left = {p.name for p in run.path.rglob("*") if p.is_file()}
    assert left - {"train.log"} == {"config.yaml", "status.json", ".lock"}


def test_a_run_knows_its_data_wherever_it_is_opened_from(tiny_config, tmp_path, monkeypatch):
    cfg = tiny_config("schedule.steps=2")
    monkeypatch.chdir(Path(cfg.paths.data).parent)
    name = cfg.paths.data = Path(cfg.paths.data).name
    run = RunFolder(tmp_path / "run")
    train(cfg, run)
    monkeypatch.chdir(tmp_path)
    assert len(open_run(run).data.prepared) == 24
    assert not (tmp_path / name).exists()


def test_the_last_checkpoint_is_the_evaluated_one_and_evaluation_resumes(tiny_config, tmp_path):
    run, config = RunFolder(tmp_path), tiny_config("trainer.checkpoint_every=3")
    train(config, run)
    assert torch.load(run.checkpoint, weights_only=True)["global_step"] == 8
    before = samples(run)
    run.set_status("running")  # as a kill during the evaluation leaves it
    (run.evaluation(FEW) / "samples.csv").unlink()
    train(config, run)
    assert run.finished
    assert samples(run) == before


class _ReadsBack(TorchDispatchMode):
    """Counts operations after which a GPU's host would have to wait."""

    count = 0

    def __torch_dispatch__(self, operation, types, args=(), kwargs=None):
        waits = ("_local_scalar_dense", "nonzero", "masked_select", "unique")
        self.count += any(name in str(operation) for name in waits)
        return operation(*args, **(kwargs or {}))


def test_a_step_reads_nothing_back(tiny_config, tmp_path, monkeypatch):
    mode, counts = _ReadsBack(), []
    monkeypatch.setattr(Clock, "on_train_batch_end", lambda *_: counts.append(mode.count))
    overrides = ["trainer.val_every=8", "trainer.checkpoint_every=8", "logger.every=8"]
    with mode:
        train(tiny_config(*overrides, "regime=r", "trainer.progress_bar=true"), RunFolder(tmp_path))
    assert len(counts) == 8
    assert counts[0] == counts[6], "between the first step and the one before logs and checkpoint"
    assert mode.count > counts[6], "reading back is counted"


def test_a_damaged_checkpoint_is_named_and_one_process_trains_a_run(tiny_config, tmp_path):
    run = RunFolder(tmp_path)
    with run.lock(), pytest.raises(ConfigError, match="another process"):
        train(tiny_config(), run)
    run.checkpoint.parent.mkdir()
    others = tmp_path / "others.ckpt"  # a plain Lightning training's
    torch.save({"global_step": 3, "state_dict": {}}, others)
    for content in (b"PK not a checkpoint", others.read_bytes()):
        run.checkpoint.write_bytes(content)
        with pytest.raises(DataError, match=r"last\.ckpt is damaged.*restart=true"):
            train(tiny_config(), run)
        assert run.status["state"] == "failed"
    train(tiny_config("restart=true", "schedule.steps=2"), run)
    assert run.finished


def command(tmp_path, data_root, *arguments):
    paths = (f"paths.data={data_root}", f"paths.runs={tmp_path}")
    return ["train.py", *arguments, *TINY, *paths]


def the_run(tmp_path):
    (run,) = find_runs(tmp_path)
    return run


def test_kill_9_and_the_same_command_give_the_same_metrics(finished, prepared, data_root, tmp_path):
    arguments = command(tmp_path, data_root, "logger.every=1")[1:]
    # Before a validation, after step 4, and before step 6 is saved, the second that would be.
    for method, nth, left in (("on_validation_start", 1, 2), ("_save_checkpoint", 2, 4)):
        done = python("-c", killed("train", SAVING, method, nth), *arguments)
        assert done.returncode == -signal.SIGKILL, done.stderr
        run = the_run(tmp_path)
        assert run.status["state"] == "running"
        assert torch.load(run.checkpoint, weights_only=True)["global_step"] == left
    assert run_command("train", *arguments).returncode == 0
    assert samples(the_run(tmp_path)) == samples(finished[0])
    assert curves(the_run(tmp_path)) == curves(finished[0])


def test_a_sweep_trains_what_can_be_trained_side_by_side_or_not(prepared, data_root, tmp_path):
    own = ("templates.count=2,500", "schedule.steps=2")
    launcher = ("hydra/launcher=joblib", "hydra.launcher.n_jobs=2")
    first = run_command("train", *command(tmp_path, data_root, "-m", *launcher, *own)[1:])
    assert first.returncode == 1
    assert "1 of 2 runs failed" in first.stderr
    assert "Scores" in first.stdout
    states = Results.read(tmp_path).runs.set_index("templates")
    assert states["state"].to_dict() == {2: "finished", 500: "failed"}
    assert "only 21 shapes to choose from" in states.loc[500, "reason"]
    told = hparams_of(EventAccumulator(str(tmp_path / states.loc[2, "run"])).Reload())
    assert told["network.hidden"].number_value == 32
    assert not list(tmp_path.rglob(".jobs-*"))
    second = run_command("train", *command(tmp_path, data_root, "-m", *own)[1:])
    assert second.returncode == 1
    assert "finished already" in second.stdout + second.stderr


def test_a_run_that_is_refused_before_it_begins_leaves_nothing_behind(tmp_path):
    done = run_command("train", "encoder.weights=absent.h5", cwd=tmp_path)
    assert done.stderr.startswith("error: encoder.weights=absent.h5")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("degrees", ["[3,3],[3,3,3]", "[3,3,3],[3,3]"])
def test_a_value_of_any_job_is_refused_in_one_line_before_the_first(degrees, tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    sweep = ("-m", f"network.degrees={degrees}", "seed=0,1", f"paths.runs={tmp_path}/runs")
    done = python(str(ROOT / "train.py"), *sweep, f"paths.data={tmp_path}/data", folder=tmp_path)
    assert done.returncode == 1
    assert done.stderr == "error: network.degrees=[3,3] must be 3 values\n"
    assert not [path for path in tmp_path.iterdir() if not path.name.startswith("torchinductor")]


def test_a_sweep_without_an_ended_job_fails(tmp_path):
    config = {"hydra": {"sweep": {"dir": str(tmp_path)}}, "callbacks": {"report": False}}
    callback = SweepEnd()
    callback.on_multirun_start(OmegaConf.create(config))
    with pytest.raises(SystemExit, match="no job"):
        callback.on_multirun_end(OmegaConf.create(config))


def test_a_job_that_is_refused_stops_no_other_of_the_same_folder(prepared, data_root, tmp_path):
    sweep = ("evaluation.subset=val,test", "split.val_fraction=0", "schedule.steps=2")
    done = run_command("train", *command(tmp_path, data_root, "-m", *sweep)[1:])
    assert done.returncode == 1
    assert "1 of 2 runs failed" in done.stderr
    assert the_run(tmp_path).finished


def test_what_is_asked_to_end_lets_its_training_end(tmp_path):
    """It may have begun jobs in processes of their own, which a kill would leave."""
    script = tmp_path / "training.py"
    script.write_text(
        "import os, pathlib, signal, time\n"
        "signal.signal(signal.SIGTERM, signal.default_int_handler)\n"
        "try:\n"
        "    os.kill(os.getppid(), signal.SIGTERM)\n"
        "    time.sleep(600)\n"
        "except KeyboardInterrupt:\n"
        "    time.sleep(1)\n"
        "    pathlib.Path(__file__).with_name('ended').touch()\n"
    )
    before = signal.getsignal(signal.SIGTERM)
    try:
        with pytest.raises(KeyboardInterrupt):
            run_to_end([sys.executable, str(script)])
    finally:
        signal.signal(signal.SIGTERM, before)
    assert (tmp_path / "ended").exists()


def test_a_sweep_over_devices_is_not_started_twice(prepared, data_root, tmp_path, capfd):
    devices = ("trainer=ddp", "trainer.accelerator=cpu", "trainer.devices=2", "schedule.steps=2")
    arguments = [x for x in command(tmp_path, data_root, "-m")[1:] if x != "trainer=cpu"]
    done = run_command("train", *arguments, *devices)
    assert done.returncode == 0, done.stderr
    assert Results.read(tmp_path).runs["state"].tolist() == ["finished"]
    assert "Launching 1 jobs" in done.stdout
    written = capfd.readouterr().out  # the other device's process, which writes past this one
    assert "GLOBAL_RANK: 1" in written
    assert "Launching" not in written
