import numpy as np
from cloud_set import set_of

from ffd_lightning.data.categories import PAPER_CATEGORIES, paper_templates
from ffd_lightning.data.templates.choice import (
    AutoTemplates,
    ListedTemplates,
    MedoidTemplates,
    PaperTemplates,
    RandomTemplates,
    choose_templates,
)


def choose_from(prepared, path, text, count=2):
    path.write_bytes(text.encode())
    return choose_templates(ListedTemplates(path), prepared, count)


def test_random_is_a_function_of_the_seed(prepared):
    draws = [choose_templates(RandomTemplates(s), prepared, 4) for s in (0, 0, 1, 2, 3)]
    assert draws[0] == draws[1]
    assert len(set(draws)) == 4
    for strategy in (MedoidTemplates(), RandomTemplates()):
        chosen = choose_templates(strategy, prepared, len(prepared))
        assert sorted(chosen) == list(prepared.ids), "all of them, if so many are wanted"


def test_ids_may_come_in_an_array(prepared):
    chosen = choose_templates(lambda some, count: np.array(some.ids)[:count], prepared, 2)
    assert chosen == prepared.ids[:2]
    assert {type(i) for i in chosen} == {str}, "as checkpoints can be opened with"


def test_listed_keeps_the_order_of_the_file_and_reads_a_ranking_by_its_column(prepared, tmp_path):
    a, b, c = prepared.ids[7], prepared.ids[2], prepared.ids[5]
    text = f"\ufeff# chosen by hand\r\n\n  {a}  # the first\n{a}\r\n\n{b}\n{c}\n"
    assert choose_from(prepared, tmp_path / "ids", text) == (a, b)
    assert choose_from(prepared, tmp_path / "ids", text, 3) == (a, b, c)
    text = f"rank,id,family\n1,{a},x\n\n2,{a},x\n3, {b},x\n4\n"
    assert choose_from(prepared, tmp_path / "r.csv", text) == (a, b)


def test_a_list_may_name_any_shape_and_its_file_the_category(prepared, tmp_path):
    (tmp_path / "table.txt").write_text("\n".join(prepared.ids[:2]))
    strategy = ListedTemplates(str(tmp_path / "{category}.txt"))
    assert choose_templates(strategy, prepared, 2, prepared.ids[1:9]) == prepared.ids[:2]


def as_shapenet(prepared, ids, source="shapenet"):
    """The prepared set under other ids, as if it came from ShapeNet."""
    names = sorted([*ids, *(f"other{k:02d}" for k in range(len(prepared) - len(ids)))])
    clouds = (prepared.cloud(row) for row in range(len(prepared)))
    return set_of(clouds, names, "table", source)


def test_shapenet_takes_the_papers_templates_by_default(prepared):
    for category in PAPER_CATEGORIES:
        assert len(set(paper_templates(category))) == 30
    assert paper_templates("rifle") == paper_templates("mug") == ()
    known = paper_templates("table")[:6]
    there = as_shapenet(prepared, known)
    assert choose_templates(AutoTemplates(), there, 4) == known[:4]
    elsewhere = as_shapenet(prepared, known, source="folder")
    medoids = choose_templates(MedoidTemplates(), elsewhere, 4)
    assert choose_templates(AutoTemplates(), elsewhere, 4) == medoids
    assert choose_templates(PaperTemplates(), elsewhere, 4) == known[:4]


def test_medoids_of_the_others_stand_for_absent_templates(prepared, caplog):
    known = paper_templates("table")[:6]
    held = (known[0], known[2], *known[4:])
    there = as_shapenet(prepared, held)
    chosen = choose_templates(PaperTemplates(), there, 8)
    assert chosen[:4] == held
    assert chosen[4:] == MedoidTemplates()(there.without(held), 4)
    assert f"{known[1]}, {known[3]}" in caplog.text
    assert choose_templates(PaperTemplates(), there, 3) == held[:3]


def test_the_papers_templates_may_be_tested_on_and_what_is_added_may_not(prepared):
    known = paper_templates("table")[:3]
    there = as_shapenet(prepared, known[:2])
    tested = {known[0], *(i for k, i in enumerate(there.ids) if k % 2 and i not in known)}
    chosen = choose_templates(PaperTemplates(), there, 8, tested)
    assert chosen[:2] == known[:2]
    assert not set(chosen[2:]) & tested
    further = as_shapenet(prepared, paper_templates("table")[6:])  # all that there is
    assert set(further.ids) < set(paper_templates("table"))
    assert len(set(choose_templates(PaperTemplates(), further, 3))) == 3
