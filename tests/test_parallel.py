import threading

import pytest
import torch

from ffd_lightning.parallel import in_threads


def test_torch_has_one_thread_and_what_ends_early_begins_no_more():
    begun, threads = [], set()

    def work(k):
        begun.append(k)
        threads.add((threading.current_thread().name.split("_")[0], torch.get_num_threads()))
        threading.Event().wait(0.01)
        if k == 50:
            raise ZeroDivisionError
        return k

    before = torch.get_num_threads()
    results = in_threads(work, range(100), 2)
    next(results)
    results.close()
    assert len(begun) < 100
    assert threads == {("worker", 1)}
    assert torch.get_num_threads() == before
    with pytest.raises(ZeroDivisionError):
        list(in_threads(work, range(1000), 4))
    assert len(begun) < 1000
