"""Sort the real furniture and cars of Debian's package sweethome3d-furniture into folders.

    apt-get download sweethome3d-furniture
    dpkg -x sweethome3d-furniture_*.deb furniture
    python docs/tools/furniture.py furniture meshes
    python train.py data=folder data.root=meshes data.yaw=180 category=chair

Its five libraries are CC-BY 3.0 and CC0 (furniture/usr/share/doc says which is which). What the
catalogue calls a chair, armchair, stool, table or desk is taken, and so on for other categories,
less what only has the word in its name.
"""

import re
import sys
import zipfile
from pathlib import Path

CATEGORIES = {
    "bench": r"\bbench",
    "cabinet": r"cabinet|wardrobe|cupboard|bookcase|dresser|chest$|shelves",
    "car": r"sedan|beetle|leon|ford|peugeot|renault|chevrolet|smart car|suv|\bvan\b|\bbus\b",
    "cellphone": r"iphone|mobile phone|wireless phone",
    "chair": r"\b(arm)?chair|\bstool",
    "lamp": r"lamp\b",
    "monitor": r"\btv( 16:9)?$|imac|^screen$",
    "plane": r"plane$",
    "sofa": r"sofa\b|couch",
    "speaker": r"speaker",
    "table": r"\btable\b|\bdesk\b",
    "watercraft": r"boat",
}
_NOT = (
    r"lamp artwork|\bfan\b|bat$|tennis|football|pool|ottoman|wheelchair|bedside|changing|"
    r"dressing|abdominal|opened|work|upper"
)


def sort(library: Path, out: Path) -> int:
    """Unpack the shapes of one library (.sh3f); return how many."""
    count = 0
    with zipfile.ZipFile(library) as archive:
        text = archive.read("PluginFurnitureCatalog.properties").decode("latin-1")
        entries = dict(line.split("=", 1) for line in text.splitlines() if "=" in line)
        for key, name in entries.items():
            kinds = [c for c, words in CATEGORIES.items() if re.search(words, name, re.I)]
            excluded = re.search(_NOT, name, re.I)
            if not key.startswith("name#") or not kinds or excluded:
                continue
            model = entries[f"model#{key.removeprefix('name#')}"].strip().lstrip("/")
            folder = model.rpartition("/")[0]
            shape = out / kinds[0] / f"{library.stem}-{Path(model).stem}"
            for member in archive.namelist():
                if member.startswith(f"{folder}/") and not member.endswith("/"):
                    file = shape / member.removeprefix(f"{folder}/")
                    file.parent.mkdir(parents=True, exist_ok=True)
                    file.write_bytes(archive.read(member))
            count += 1
    return count


def main(furniture: Path, out: Path) -> int:
    """See the top of this file."""
    libraries = sorted(furniture.rglob("*.sh3f"))
    if not libraries:
        print(f"error: no .sh3f files below {furniture}: unpack the package there", file=sys.stderr)
        return 2
    print(f"{out}: {sum(sort(library, out) for library in libraries)} shapes")
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
