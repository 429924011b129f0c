"""Which templates each setting selects: bars in one common order, with their pictures."""

from typing import Any

from ffd_lightning.analysis.naming import SETTING, differing, name_of, own_names
from ffd_lightning.analysis.report.gallery import Opened, data_uri, rendered
from ffd_lightning.analysis.results import Results
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.metrics.selection import effective_templates
from ffd_lightning.palette import REGIME_COLORS

_BARS = 12
_THUMBNAIL = 84, 112  # height and width


def bars(results: Results) -> dict[str, Any]:
    """Return what `selection.html` draws: of each category, the templates and each setting's bars.

    Templates are in one order for all settings: the most selected over settings alike first, of
    equals by id. Shares are means over seeds, and add up to 1 with those of all "others".
    """
    by = differing(results.scored) or ["regime"]
    found = []
    for category, part in results.samples.groupby("category", sort=False):
        part = part.assign(template=own_names(part["template"], str(category)))
        counts = part.groupby(["run", "template"]).size().unstack(fill_value=0)
        shares = counts.div(counts.sum(axis=1), axis=0)
        firsts = part.drop_duplicates("run").set_index("run")
        groups = [(row, shares.loc[row.index]) for _, row in firsts.groupby(SETTING, sort=False)]
        total = sum(of_runs.mean() for _, of_runs in groups).sort_index()
        order = total.sort_values(ascending=False, kind="stable").index
        settings = []
        for rows, of_runs in groups:
            mean, row = of_runs.mean()[order], rows.iloc[0].to_dict()
            drawn = [(str(name), float(share)) for name, share in mean[:_BARS].items()]
            if len(order) > _BARS:
                drawn.append(("others", float(mean[_BARS:].sum())))
            effective = of_runs.apply(lambda c: effective_templates(c[c > 0]), axis=1).mean()
            settings.append(
                {
                    "title": name_of(row, by),
                    "color": REGIME_COLORS.get(str(row["regime"]), ""),
                    "effective": f"{effective:.1f} of {row['templates']}",
                    "bars": drawn,
                }
            )
        found.append({"category": category, "settings": settings})
    # Of many templates, others together have half of the samples: no bar would be seen beside them.
    highest = max(share for c in found for s in c["settings"] for _, share in s["bars"][:_BARS])
    return {"categories": found, "highest": highest}


def pictures(results: Results, opened: Opened) -> dict[str, tuple[str, str]]:
    """Return pictures of templates that are selected, by `<category>/<id>`.

    Each has its name in the page, and its data.
    """
    drawn: dict[str, tuple[str, str]] = {}
    for name, part in results.samples.groupby("run", sort=False):
        run, wanted, category = opened.runs.get(str(name)), set(part["template"]), part["category"]
        meshes = () if run is None else zip(run.data.bank.ids, run.data.bank.meshes, strict=True)
        for template, mesh in meshes:
            # Trained together with other categories, a template is called <category>/<id>.
            key = f"{category.iloc[0]}/{template}" if category.nunique() == 1 else template
            if template in wanted and key not in drawn:
                picture = data_uri(rendered(mesh, Camera(), _THUMBNAIL), "image/png")
                drawn[key] = f"template-{len(drawn)}", picture
    return drawn
