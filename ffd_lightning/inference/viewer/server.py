"""The viewer's server: a page of its own for every visitor."""

from typing import Any

from ffd_lightning.errors import ConfigError
from ffd_lightning.inference.viewer.page import Page
from ffd_lightning.inference.viewer.shared import Shared

_BRAND = (52, 73, 94)  # of no regime


def start(shared: Shared, port: int = 8080) -> Any:
    """Serve the page to this machine and return viser's server; `stop()` ends it.

    Where the port is taken, the next one that is free is used.
    """
    server = import_viser().ViserServer(
        host="127.0.0.1", port=port, label="ffd_lightning", verbose=False
    )
    server.gui.configure_theme(
        control_width="large", show_logo=False, show_share_button=False, brand_color=_BRAND
    )
    server.gui.main_panel.dock_right()
    server.scene.set_up_direction("+y")
    server.scene.configure_environment_map("warehouse", environment_intensity=0.5)
    pages: dict[int, Page] = {}

    @server.on_client_connect
    def _(client: Any) -> None:
        pages[client.client_id] = Page(client, shared)
        if client.client_id not in server.get_clients():  # it left meanwhile
            close(client)

    @server.on_client_disconnect
    def close(client: Any) -> None:
        page = pages.pop(client.client_id, None)
        if page is not None:
            page.close()

    return server


def import_viser() -> Any:
    """Return the package that serves the page."""
    try:
        import viser
    except ImportError:
        raise ConfigError("the viewer needs viser: pip install 'ffd_lightning[viewer]'") from None
    return viser
