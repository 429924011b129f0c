import hashlib

from ffd_lightning.pretrained import pretrained_model


def test_runs_of_one_name_start_from_one_model():
    """Another model needs another word than `embedded`, else runs are mixed."""
    digest = "bed75d7d5087d9a712b759d8d3c2c946d1a937bdf3c5977bd76b8c02996e41a2"
    assert hashlib.sha256(pretrained_model().read_bytes()).hexdigest() == digest
