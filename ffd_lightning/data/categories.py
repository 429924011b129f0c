"""The paper's 13 categories and their ShapeNet v1 synsets."""

from __future__ import annotations

SYNSETS: dict[str, str] = {
    "plane": "02691156",
    "bench": "02828884",
    "cabinet": "02933112",
    "car": "02958343",
    "cellphone": "02992529",
    "chair": "03001627",
    "monitor": "03211117",
    "lamp": "03636649",
    "speaker": "03691459",
    "firearm": "03948459",
    "sofa": "04256520",
    "table": "04379243",
    "watercraft": "04530566",
}
