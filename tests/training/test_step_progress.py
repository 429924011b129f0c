from ffd_lightning import progress
from ffd_lightning.app.training_run import train
from ffd_lightning.run_folder import RunFolder
from ffd_lightning.training.module import FfdModule


def test_a_log_has_a_line_now_and_then_and_no_bar(tiny_config, tmp_path, monkeypatch, capfd):
    now, step = [0.0], FfdModule.training_step

    def slow(self, *arguments):
        now[0] += 6
        return step(self, *arguments)

    monkeypatch.setattr(FfdModule, "training_step", slow)
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    run = RunFolder(tmp_path)
    train(tiny_config("trainer.progress_bar=true", "logger.tensorboard=false"), run)
    out, err = capfd.readouterr()
    assert "\r" not in out + err
    lines = [line for line in err.splitlines() if "training" in line]
    assert [line.split(" of ")[0] for line in lines] == [f"  training: {n}" for n in (2, 4, 6, 8)]
    words = lines[0].split(", ")
    assert words[3] == "about 36 s left"
    score = float(words[2].removeprefix("box Chamfer "))
    assert 1 < score < 500, "times 1000, of a box of diagonal 1"
