import hashlib

from ffd_lightning.pretrained import pretrained_model


def test_runs_of_one_name_start_from_one_model():
    """Another model needs another word than `embedded`, else runs are mixed."""
    digest = "efd1e08c484be384d23ef69e6e359db30893512003320eab842c46b61b3f9f54"
    assert hashlib.sha256(pretrained_model().read_bytes()).hexdigest() == digest
