import threading
from concurrent.futures import wait
from contextlib import suppress

import pytest
import torch

from ffd_lightning import parallel
from ffd_lightning.parallel import available_cores, in_threads


@pytest.mark.parametrize("workers", [1, 2, 5])
def test_every_item_is_done_once(workers):
    assert dict(in_threads(lambda k: k * k, range(40), workers)) == {k: k * k for k in range(40)}
    assert list(in_threads(lambda k: k, [], workers)) == []


def test_items_are_taken_as_they_are_needed_and_torch_has_one_thread():
    taken, threads = [], set()

    def items():
        for k in range(100):
            taken.append(k)
            yield k

    def work(k):
        threads.add((threading.current_thread().name.split("_")[0], torch.get_num_threads()))
        return k

    before = torch.get_num_threads()
    results = in_threads(work, items(), 2)
    next(results)
    assert len(taken) <= 4
    results.close()
    assert threads == {("worker", 1)}
    assert torch.get_num_threads() == before


def test_an_error_ends_the_work():
    done = []

    def work(k):
        if k == 3:
            raise ZeroDivisionError
        done.append(k)

    with pytest.raises(ZeroDivisionError):
        list(in_threads(work, range(1000), 2))
    assert len(done) < 100


def test_what_is_done_comes_before_an_error(monkeypatch):
    def work(k):
        if k % 2:
            raise ZeroDivisionError
        return k

    def all_of_them(futures, **_):  # a busy machine looks only once all are done
        return wait(futures)

    monkeypatch.setattr(parallel, "wait", all_of_them)
    for _ in range(20):
        found = []
        with suppress(ZeroDivisionError):
            found.extend(k for k, _ in in_threads(work, range(8), 4))
        assert sorted(found) == [0, 2, 4, 6]


def test_there_is_a_core():
    assert available_cores() >= 1
