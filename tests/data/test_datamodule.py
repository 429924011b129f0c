import numpy as np
import pytest
import torch

from ffd_lightning.config import TemplateStrategy
from ffd_lightning.data.datamodule import EvaluationChunks, StepSampler, TrainingSteps
from ffd_lightning.data.templates import TemplateBank, choose_templates
from ffd_lightning.errors import ConfigError
from ffd_lightning.training.run import build_data


@pytest.fixture(scope="module")
def bank(prepared):
    return TemplateBank(prepared, choose_templates(prepared, 2, TemplateStrategy.diverse))


@pytest.fixture
def steps(prepared, bank):
    def make(seed=0, **kwargs):
        return TrainingSteps(prepared, bank, np.arange(3, 13), 4, 64, seed, **kwargs)

    return make


def tensors(batch):
    return [batch.rows, batch.images, batch.target_points, *batch.templates]


def same(a, b):
    return all(torch.equal(x, y) for x, y in zip(tensors(a), tensors(b), strict=True))


def test_a_step_depends_on_seed_and_index_alone(steps):
    one, two = steps(), steps()
    forward = [one[k] for k in range(6)]
    backward = [two[k] for k in reversed(range(6))][::-1]
    assert all(same(a, b) for a, b in zip(forward, backward, strict=True))
    assert not same(forward[0], steps(seed=1)[0])


def test_points_are_new_at_every_step_and_belong_to_their_model(steps, prepared):
    dataset = steps()
    seen = {}
    for k in range(10):
        batch = dataset[k]
        for row, cloud in zip(batch.rows.tolist(), batch.target_points, strict=True):
            all_points = torch.from_numpy(np.array(prepared.points[row]))
            assert len(cloud.unique(dim=0)) == 64
            assert (torch.cdist(cloud, all_points).amin(1) < 1e-3).all()
            assert not any(torch.equal(cloud, other) for other in seen.setdefault(row, []))
            seen[row].append(cloud)


def test_every_model_is_seen_once_a_pass_and_order_changes(steps):
    dataset = steps()
    rows = [r for k in range(5) for r in dataset[k].rows.tolist()]
    first, second = rows[:10], rows[10:]
    assert sorted(first) == sorted(second) == list(range(3, 13))
    assert first != second


def test_images_are_those_of_the_rows(steps, prepared):
    batch = steps()[0]
    assert batch.images.dtype == torch.uint8
    for row, image in zip(batch.rows.tolist(), batch.images, strict=True):
        np.testing.assert_array_equal(
            image.permute(1, 2, 0).numpy(), prepared.images[row, 0, ..., :3]
        )


def test_devices_share_the_batch(steps):
    whole = steps()[2].rows
    parts = [steps(rank=r, world_size=2)[2] for r in range(2)]
    assert torch.equal(torch.stack([p.rows for p in parts], 1).flatten(), whole)
    with pytest.raises(ConfigError, match="batch_size=4"):
        steps(world_size=3)


def test_the_sampler_starts_where_training_stopped():
    sampler = StepSampler(3, 6)
    assert list(sampler) == [3, 4, 5]
    assert len(sampler) == 6


def test_evaluation_covers_its_rows_once_with_fixed_points(prepared, bank):
    chunks = EvaluationChunks(prepared, bank, np.arange(7), 3, 64)
    assert len(chunks) == 3
    assert torch.cat([c.rows for c in chunks]).tolist() == list(range(7))
    assert same(chunks[1], EvaluationChunks(prepared, bank, np.arange(7), 3, 64)[1])


def test_the_module_keeps_templates_and_both_parts_apart(tiny_config, prepared):
    data = build_data(tiny_config())
    data.prepare_data()
    data.setup()
    train, test, templates = set(data.split.train), set(data.split.test), set(data.bank.ids)
    assert train.isdisjoint(test)
    assert templates.isdisjoint(train | test)
    assert train | test | templates == set(data.prepared.ids)
    first = next(iter(data.train_dataloader()))
    assert {data.prepared.ids[r] for r in first.rows.tolist()} <= train
