import hashlib

from ffd_lightning.pretrained import pretrained_model


def test_runs_of_one_name_start_from_one_model():
    """Another model needs another word than `encoder.weights=embedded`, else runs are mixed."""
    digest = hashlib.sha256(pretrained_model().read_bytes()).hexdigest()
    assert digest == "d35a5292f4e21796e565f278e8f6bcf3820abc4a5226581403ac5aeefd2bb6b2"
