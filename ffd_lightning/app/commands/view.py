"""Look at reconstructions in a local page, pull at them, and try photographs.

    ffd view                                     photos, by the model that comes with the package
    ffd view run=runs/demo/table/r/t16/seed0     a run's test shapes, and photos
    ffd view image=photo.png mask=mask.png       a photo to begin with
    ffd view templates=my_meshes yaw=180         your meshes as templates

The page is served to this machine only. Every browser window that opens it has a state of its own.
Needs viser: pip install 'ffd_lightning[viewer]'
"""

import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from ffd_lightning.app.commands.predict import file_bytes
from ffd_lightning.app.config import TemplateSettings
from ffd_lightning.components import Range
from ffd_lightning.errors import ConfigError, UserError
from ffd_lightning.evaluation.samples import Subset
from ffd_lightning.inference.predictor import Predictor
from ffd_lightning.inference.viewer.server import import_viser, start
from ffd_lightning.inference.viewer.shared import Photo, Shared
from ffd_lightning.run_folder import RunFolder

MAIN = "run"
ALONE = True


@dataclass
class Settings(TemplateSettings):
    """Settings of `ffd view`.

    Attributes:
        run: a run folder, or a checkpoint file (then for photographs alone); null for the model
            that comes with the package.
        checkpoint: another checkpoint than the run's newest.
        image: a photograph to begin with.
        mask: of the object in image, bright where it is; by default the background is told by the
            photograph itself.
        data_root: where the run's prepared data is (`paths.data`), if not where it was; the meshes
            of templates= are prepared there, or in the folder `data`.
        port: of the page; the next one that is free is taken if it is in use.
        device: cpu, cuda, cuda:1, ..., or auto, a GPU if there is one.
    """

    run: str | None = None
    checkpoint: str | None = None
    image: str | None = None
    mask: str | None = None
    data_root: str | None = None
    port: Annotated[int, Range("[1, 65535]")] = 8080
    device: str = "auto"


def main(settings: Settings) -> int:
    """Serve the page until interrupted."""
    if settings.mask and not settings.image:
        raise ConfigError("mask= is of a photograph: name it by image=")
    import_viser()  # before anything is loaded that would be for nothing
    shared = open_shared(settings)
    server = start(shared, settings.port)
    if shared.note:
        print(shared.note)
    print(f"http://127.0.0.1:{server.get_port()}  (Ctrl-C ends it)", flush=True)
    with suppress(KeyboardInterrupt):
        while True:  # one wait without end does not see a Ctrl-C that comes just before it
            time.sleep(1)
    server.stop()
    return 0


def open_shared(settings: Settings) -> Shared:
    """Load a run, or a checkpoint alone, and the photograph to begin with."""
    predictor = Predictor.load(settings.checkpoint or settings.run, settings.device)
    own = settings.named_templates(predictor.model, settings.data_root or "data")
    predictor = predictor if own is None else predictor.told(own, beside=settings.beside)
    shapes, note = None, "A checkpoint alone: open a photo."
    path = None if settings.run is None else Path(settings.run)
    if path is not None and path.is_dir():
        from ffd_lightning.app.open_run import open_data  # loads Lightning

        try:
            data = open_data(RunFolder(path), settings.data_root)
            data.setup()
            shapes, note = Subset(data.prepared, data.rows(data.split.test)), ""
        except UserError as error:
            note = f"No test shapes, photos only: {error}"
    if settings.image is None:
        return Shared(predictor, shapes, None, note)
    mask = None if settings.mask is None else file_bytes(Path(settings.mask))
    image = Path(settings.image)
    photo = Photo(image.name, file_bytes(image), mask)
    shared = Shared(predictor, shapes, photo, note)
    shared.open_photo(photo)  # what is wrong with it is said before anybody looks
    return shared
