import hashlib

import pytest

from ffd_lightning.pretrained import pretrained_model


@pytest.mark.parametrize(
    ("conditioned", "digest"),
    [
        (False, "d35a5292f4e21796e565f278e8f6bcf3820abc4a5226581403ac5aeefd2bb6b2"),
        (True, "3ad0d2c98382ac713a08b370f8d1bc605db8c6f949c2ab25004c81d0cc0fe89d"),
    ],
)
def test_runs_of_one_name_start_from_one_model(conditioned, digest):
    """Another model needs another word than `embedded`, else runs are mixed."""
    assert hashlib.sha256(pretrained_model(conditioned).read_bytes()).hexdigest() == digest
