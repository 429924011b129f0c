import pytest

from ffd_lightning.errors import ConfigError
from ffd_lightning.pretrained import pretrained_digest, pretrained_model


def test_the_model_is_where_it_lies_and_told_by_its_content(shipped):
    assert pretrained_model() == shipped
    before = pretrained_digest()
    assert before == pretrained_digest()
    shipped.write_bytes(shipped.read_bytes() + b"!")
    assert before != pretrained_digest()
    assert len(before) == 8


@pytest.mark.usefixtures("nothing_shipped")
@pytest.mark.parametrize("ask", [pretrained_model, pretrained_digest])
def test_where_none_came_with_the_package_the_way_out_is_said(ask):
    with pytest.raises(ConfigError, match="no trained model: give yours with run=RUN"):
        ask()
