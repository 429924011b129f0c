import hashlib

from ffd_lightning.pretrained import pretrained_model


def test_runs_of_one_name_start_from_one_model():
    """Another model needs another word than `embedded`, else runs are mixed."""
    digest = "21751f5238336bf8eb7c0c239fdbc26a35623ed05e24b94637281facb5bd3a06"
    assert hashlib.sha256(pretrained_model().read_bytes()).hexdigest() == digest
