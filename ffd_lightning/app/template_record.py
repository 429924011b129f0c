"""What a run folder says of its templates, from the training's start on."""

from __future__ import annotations

import io
import logging

from PIL import Image

from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.data.templates.summary import outlier_note, outlier_rows, template_rows
from ffd_lightning.evaluation.figures import template_figure
from ffd_lightning.files import write_bytes_atomic, write_csv
from ffd_lightning.run_folder import RunFolder

log = logging.getLogger(__name__)


def record_templates(run: RunFolder, data: FfdDataModule) -> None:
    """Write `templates.csv`, `templates.png` and, if there are outliers, `outliers.csv`; log them.

    Args:
        run: whose folder to write to.
        data: set up.
    """
    bank = data.bank
    rows, coverage = template_rows(data.prepared, bank)
    write_csv(run.templates, rows)
    notes = [f"nearest to {100 * row['share']:.0f}% of the shapes" for row in rows]
    buffer = io.BytesIO()
    Image.fromarray(template_figure(bank, notes)).save(buffer, "PNG")
    write_bytes_atomic(run.templates_picture, buffer.getvalue())
    log.info(
        "%s: T = %d templates (templates.csv, templates.png); mean box Chamfer x 1000 of the other "
        "shapes to the nearest: %.1f; ids: %s",
        run.path,
        len(bank),
        1000 * coverage,
        ", ".join(bank.ids),
    )
    outliers = outlier_rows(data.prepared)
    run.outliers.unlink(missing_ok=True)
    if outliers:
        write_csv(run.outliers, outliers)
        note = outlier_note(data.prepared, outliers, data.drop_outliers)
        chosen = len({row["id"] for row in outliers}.intersection(bank.ids))
        log.warning("%s: %s (outliers.csv); %d of them are templates", run.path, note, chosen)
