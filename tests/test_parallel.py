import threading
from concurrent.futures import ThreadPoolExecutor, wait

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


def test_calls_that_overlap_leave_torch_its_threads():
    """As of two threads of a viewer: the second begins in the first, and ends after it."""
    torch.set_num_threads(3)
    seen = []

    def of_a_new_thread():
        with ThreadPoolExecutor(1) as pool:
            return pool.submit(torch.get_num_threads).result()

    def work(k):
        seen.append(torch.get_num_threads())
        return k

    with ThreadPoolExecutor(1) as one, ThreadPoolExecutor(1) as other:
        assert one.submit(torch.get_num_threads).result() == 3
        first, second = in_threads(work, range(9), 1), in_threads(work, range(9), 5)
        one.submit(next, first).result()
        other.submit(next, second).result()
        one.submit(list, first).result()
        assert (one.submit(torch.get_num_threads).result(), of_a_new_thread()) == (3, 1)
        other.submit(list, second).result()
        assert [x.submit(torch.get_num_threads).result() for x in (one, other)] == [3, 3]
    assert of_a_new_thread() == 3
    assert set(seen) == {1}


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
