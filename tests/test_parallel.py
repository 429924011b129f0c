import threading
from concurrent.futures import wait

import pytest
import torch

from ffd_lightning import parallel
from ffd_lightning.parallel import in_threads


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
        with pytest.raises(ZeroDivisionError):
            found.extend(k for k, _ in in_threads(work, range(1000), 4))
        assert sorted(found) == [0, 2, 4, 6], "and the work ends"
