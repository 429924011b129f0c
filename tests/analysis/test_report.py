"""The page about a folder of runs."""

import base64
import csv
import io
import json
import re
import shutil
from collections import Counter
from html.parser import HTMLParser

import numpy as np
import pytest
from analysis.folders import write_run
from analysis.made import PAPER, results, run_samples
from commands import call
from conftest import FEW
from PIL import Image
from scipy.spatial import cKDTree

from ffd_lightning.analysis.figures.examples import picked, reconstruct
from ffd_lightning.analysis.report import page as page_module
from ffd_lightning.analysis.report.meshes import light_template, lighten, pack, size
from ffd_lightning.analysis.report.page import write_report
from ffd_lightning.analysis.report.selection import bars
from ffd_lightning.analysis.results import Results
from ffd_lightning.analysis.tables import best
from ffd_lightning.app.commands import report
from ffd_lightning.app.open_run import open_run
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.protocols import PaperProtocol, ProtocolDescription

EVIL = "<script>alert('x')</script>&"
MEASURES = ("chamfer", "emd", "iou")


def make_run(folder, regime="b", templates=4, seed=0, count=8, **columns):
    """Write a finished run by hand, without a checkpoint; columns are functions of the row."""
    rng = np.random.default_rng([ord(regime[0]), templates, seed])
    scores = {f"{p}{m}": rng.random(count).tolist() for p in ("", "undeformed_") for m in MEASURES}
    functions = {"template": lambda k: f"t{k % 3}"} | columns
    given = {n: [f(k) for k in range(count)] if callable(f) else f for n, f in functions.items()}
    return write_run(folder, regime, templates, seed, weight=0.5, **(scores | given))


class Page(HTMLParser):
    """What a page holds: text, attributes, tables; and whether its tags are nested well."""

    VOID = frozenset(("meta", "link", "img", "br", "wbr"))

    def __init__(self, path):
        super().__init__()
        self.open, self.attributes, self.tables, self.said = [], [], [], []
        self.tags = Counter()
        self.feed(path.read_text(encoding="utf-8"))
        assert self.open == [], "all tags are closed"

    def handle_starttag(self, tag, attrs):
        self.tags[tag] += 1
        self.attributes += [(tag, *pair) for pair in attrs]
        if tag not in self.VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, f"</{tag}> closes another"

    def handle_data(self, data):
        if not {"script", "style"} & set(self.open):
            self.said.append(data)
        if {"td", "th"} & set(self.open[-2:]):
            self.tables[-1][-1][-1] += data

    @property
    def text(self):
        return " ".join(" ".join(self.said).split())


def page_of(folder, *arguments):
    return Page(write_report(folder, open_run, *arguments))


def two_regimes(folder):
    return [make_run(folder / regime, regime) for regime in "wb"]


@pytest.fixture
def blank(monkeypatch):
    """Do not draw figures, which takes most of the time: for tests of the words."""
    monkeypatch.setattr(page_module.plots, "to_svg", lambda figure: b"<svg/>")


@pytest.fixture
def sweep(tmp_path, blank):
    """Two regimes, finished, to be changed."""
    return two_regimes(tmp_path)


# --- numbers -------------------------------------------------------------------------------------


def scores_of(**shifts):
    """Columns of scores: the same shapes, shifted by a constant for each measure."""
    return {m: lambda k, s=s: 0.3 + s + 0.01 * (k % 7) * (1 + s) for m, s in shifts.items()}


def test_the_page_opens_with_who_is_best_and_whether_it_is_shown(tmp_path, blank):
    def lead(folder, seeds, **shifts):
        for regime, shift in shifts.items():
            for seed in seeds:
                columns = scores_of(chamfer=shift, emd=shift, iou=-shift)
                make_run(folder / f"{regime}{seed}", regime, seed=seed, count=12, **columns)
        return page_of(folder).text

    text = lead(tmp_path / "one", (0,), b=0.05, w=0.0, posterior=0.1)
    assert "Best Chamfer, EMD and IoU: w, log-weighted. One training decides" in text
    text = lead(tmp_path / "two", (0, 1), b=0.05, w=0.0)
    assert ": 3 of 3 leads" in text


def test_it_says_in_what_else_the_best_differ():
    parts = [run_samples(5, x, chamfer=0.1, emd=0.1, iou=0.1) for x in "bw"]
    found = results(*parts, category__name=["table"] * 2, schedule__steps=[3, 4])
    assert "differ in schedule.steps, too" in page_module.verdict(found, best(found))[1]


def test_of_many_settings_each_category_has_its_own_best(tmp_path, blank):
    """Lamps' best, x13, is the worst of tables; y of tables alone."""
    for category, shift in {"lamp": -0.01, "table": 0.02}.items():
        for k in range(14):
            columns = scores_of(chamfer=0.3 + shift * k, emd=0.0, iou=0.0)
            make_run(tmp_path / f"{category}{k}", f"x{k}", category=category, count=4, **columns)
    make_run(tmp_path / "y", "y", category="table", count=4, **scores_of(chamfer=0.1))
    found = best(Results.read(tmp_path))
    rows = found[found["measure"] == "chamfer"]
    assert dict(zip(rows["category"], rows["a"], strict=True)) == {
        "mean of 2": "x0",
        "lamp": "x13",
        "table": "y",
    }


def test_shares_of_templates_add_up_in_one_order(tmp_path):
    make_run(tmp_path / "b", count=9, template=lambda k: f"t{k % 3}")
    make_run(tmp_path / "w", "w", count=9, template=lambda k: "t2" if k else "t0")
    make_run(tmp_path / "e", "e", templates=40, count=80, template=lambda k: f"x{k % 40}")
    (group,) = bars(Results.read(tmp_path))["categories"]
    (order,) = {tuple(name for name, _ in setting["bars"]) for setting in group["settings"]}
    assert order[:2] == ("t2", "t0"), "the most selected first"
    assert order[-1] == "others"
    for setting in group["settings"]:
        assert sum(share for _, share in setting["bars"]) == pytest.approx(1)
    assert {s["effective"] for s in group["settings"]} >= {"3.0 of 4", "40.0 of 40"}


# --- the page ------------------------------------------------------------------------------------


def test_the_page_is_whole_and_the_same_each_time(tmp_path):
    two_regimes(tmp_path)
    path = write_report(tmp_path, open_run)
    page, text = Page(path), path.read_text()
    links = [v for _, k, v in page.attributes if k in ("src", "href", "srcset", "action", "poster")]
    assert all(link.startswith(("data:", "#")) for link in links), "nothing from elsewhere"
    assert not re.search(r"@import|url\((?!data:)|fetch\(|XMLHttpRequest|import\(", text)
    assert (
        "default-src 'none'"
        in dict((t, v) for t, k, v in page.attributes if k == "content")["meta"]
    )
    assert not [k for _, k, _ in page.attributes if k.startswith("on")], "no inline handlers"
    ids = Counter(v for _, k, v in page.attributes if k == "id")
    assert set(ids.values()) == {1}
    assert {v[1:] for _, k, v in page.attributes if k == "href" and v.startswith("#")} <= set(ids)
    alts = [v for t, k, v in page.attributes if (t, k) == ("img", "alt") and v]
    assert len(alts) == page.tags["img"] == 2
    assert write_report(tmp_path, open_run).read_text() == text


def test_what_comes_from_outside_is_escaped(tmp_path, blank):
    make_run(tmp_path / "a<b>&c", template=lambda k: EVIL)
    make_run(tmp_path / "failed", seed=1).set_status("failed", reason=EVIL)
    study = {"study": EVIL, "question": EVIL, "command": EVIL}
    (tmp_path / "study.yaml").write_text(json.dumps(study))
    path = write_report(tmp_path, open_run)
    assert EVIL not in path.read_text()
    page = Page(path)
    assert page.text.count(EVIL) >= 6, "title twice, question, command, reason, a template"
    assert page.tags["script"] == 2


def test_results_of_one_name_that_were_measured_otherwise_are_not_mixed(sweep, tmp_path):
    file = make_run(tmp_path / "few", "e").evaluation("paper") / "summary.json"
    few = ProtocolDescription.of(PaperProtocol(points=64))
    file.write_text(json.dumps({"protocol": few.to_json()}))
    older = make_run(tmp_path / "older", "r").evaluation("paper") / "summary.json"
    older.write_text(json.dumps({"protocol": PAPER.to_json(), "settings": {"format": 1}}))
    page = page_of(tmp_path)
    table = next(t for t in page.tables if any("effective" in heading for heading in t[0]))
    assert [row[0][:1] for row in table[1:]] == ["b", "w"]
    assert page.text.count("evaluated under another protocol of this name") == 2


def test_the_command(sweep, tmp_path, capsys):
    assert call(report, str(tmp_path), "protocol=paper", "gallery=0") == 0
    assert capsys.readouterr().out == f"{tmp_path / 'report.html'}\n"
    assert "The same images" not in Page(tmp_path / "report.html").text
    for arguments, error, message in (
        ([f"runs={tmp_path / 'no'}"], DataError, "holds no run that can be read"),
        ([str(tmp_path), "protocol=papre"], DataError, "under protocol papre: b: "),
        ([str(tmp_path), "gallery=-1"], ConfigError, "gallery=-1"),
    ):
        with pytest.raises(error, match=message):
            call(report, *arguments)


# --- examples ------------------------------------------------------------------------------------


def sphere(divisions=70):
    """A sphere of radius 0.5, as a soup: each face has vertices of its own."""
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, divisions), np.linspace(0, np.pi, divisions))
    places = 0.5 * np.stack([np.sin(v) * np.cos(u), np.cos(v), np.sin(v) * np.sin(u)], -1)
    a, b, c, d = (
        places[i : divisions - 1 + i, j : divisions - 1 + j].reshape(-1, 3)
        for i, j in ((0, 0), (0, 1), (1, 0), (1, 1))
    )
    corners = np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])
    return corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)


@pytest.mark.parametrize(("limit", "lost"), [(60_000, 0.01), (8_000, 0.06), (3_000, 0.2)])
def test_meshes_become_small_and_keep_their_shape(limit, lost):
    vertices, faces = sphere()
    small, small_faces = lighten(vertices, faces, limit)
    assert limit / 6 < size(small, small_faces) <= limit, "no smaller than need be"
    a, b, c = (small[small_faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert (1 - lost) * np.pi < area < np.pi
    radius = np.linalg.norm(small, axis=1)
    assert (1 - lost) * 0.5 < radius.min() < radius.max() < 0.5001


@pytest.fixture(scope="module")
def written(tiny_run):
    """The report on the tiny run: its path."""
    return write_report(tiny_run.path.parent, open_run)


def test_light_meshes_lie_on_those_of_the_evaluation(tiny_run):
    opened = open_run(tiny_run)
    (example,) = reconstruct(opened, [(opened.data.split.test[0], 0)])
    light = pack(*light_template(example.deformed())).places()
    truth = pack(*lighten(*example.truth.mesh())).places()
    for places, surface in ((light, example.deformed()), (truth, example.truth)):
        vertices, faces = surface.mesh()
        assert cKDTree(vertices).query(places)[0].max() < 0.02, "the edge length of evaluation"
        extent = np.ptp(vertices[np.unique(faces)], axis=0)
        np.testing.assert_allclose(np.ptp(places, axis=0), extent, atol=5e-3)


def test_the_page_shows_images_from_the_best_to_the_worst(tiny_run, written):
    page, text = Page(written), written.read_text()
    with (tiny_run.evaluation(FEW) / "samples.csv").open() as file:
        rows = list(csv.DictReader(file))
    order = [row["id"] for row in sorted(rows, key=lambda row: float(row["chamfer"]))]
    assert re.findall(r'alt="Input image of (\S+?)[",]', text) == picked(order, "spread", 4)
    meshes = json.loads(re.search(r'id="meshes">(.*?)</script>', text, re.S)[1])
    assert {v for t, k, v in page.attributes if k == "data-mesh"} == set(meshes)
    stages = re.findall(r'<div class="stage"><img src="([^"]+)" alt="[^"]+">\s*<canvas', text)
    assert len(stages) == page.tags["canvas"] == 2 * min(4, len(order)), (
        "the network, and what is true"
    )
    for source in stages:  # a still of something, which shows where nothing can be drawn
        image = Image.open(io.BytesIO(base64.b64decode(source.partition(",")[2]))).convert("RGBA")
        assert 0.02 < (np.asarray(image)[..., 3] > 127).mean() < 0.9
    assert len(text) < 1_000_000


# --- in a browser --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def browser():
    """A page in Chromium without a window, and what it asks for and complains of."""
    playwright = pytest.importorskip("playwright.sync_api")
    programs = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    program = next(filter(None, map(shutil.which, programs)), None)
    if program is None:
        pytest.skip("no Chromium here")
    flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with playwright.sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=program, args=flags)
        page = chromium.new_page()
        page.log = []
        page.on("console", lambda message: page.log.append(message.text))
        page.on("pageerror", lambda error: page.log.append(str(error)))
        page.on("request", lambda request: page.log.append(request.url))
        yield page
        chromium.close()


# How much of the first two 3D pictures is drawn on, and a number that stands for both.
PIXELS = """new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => {
  const drawn = [];
  let hash = 0;
  for (const c of [...document.querySelectorAll("canvas[data-mesh]")].slice(0, 2)) {
    const {width, height} = c, d = c.getContext("2d").getImageData(0, 0, width, height).data;
    let on = 0;
    for (let i = 0; i < d.length; i += 4) {
      if (d[i + 3]) on += 1 / (width * height);
      hash = (hash * 31 + d[i] + 7 * d[i + 3]) >>> 0;
    }
    drawn.push(on, hash);
  }
  done(drawn);
})))"""
VISIBLE = """[...document.querySelectorAll(".stage")].map(stage => [...stage.children].map(
  e => getComputedStyle(e).visibility == "visible" && getComputedStyle(e).display != "none"))"""


def show(browser, path, width):
    """Open a page and wait until its first mesh is drawn; returns where that is."""
    browser.set_viewport_size({"width": width, "height": 900})
    browser.goto(path.as_uri())
    browser.evaluate("document.querySelector('canvas').scrollIntoView({block: 'center'})")
    browser.wait_for_function(f"({PIXELS}).then(pixels => pixels[0] > 0)")
    box = browser.locator("canvas").first.bounding_box()
    return box["x"], box["y"]


@pytest.mark.parametrize("width", [1280, 400])
def test_a_browser_shows_it_without_a_word(browser, written, width):
    browser.log.clear()
    show(browser, written, width)
    assert browser.evaluate("document.documentElement.scrollWidth") <= width
    assert [x for x in browser.log if not x.startswith("data:")] == [written.as_uri()]


def test_meshes_are_drawn_and_turn_together(browser, written):
    x, y = show(browser, written, 1000)
    first = browser.evaluate(PIXELS)
    assert all(0.02 < share < 0.9 for share in first[::2])
    browser.mouse.move(x + 40, y + 40)
    browser.mouse.down()
    browser.mouse.move(x + 100, y + 40)
    browser.mouse.up()
    turned = browser.evaluate(PIXELS)
    assert turned[1] != first[1]
    assert turned[3] != first[3], "the other one turns with it"
    browser.keyboard.press("ArrowLeft")
    assert browser.evaluate(PIXELS)[1] != turned[1]
    browser.mouse.wheel(0, -200)
    browser.wait_for_function(f"({PIXELS}).then(pixels => pixels[0] > {turned[0]})")
    browser.keyboard.press("0")
    assert browser.evaluate(PIXELS) == first


def test_fingers_turn_and_pinch(browser, written):
    x, y = show(browser, written, 400)
    tools = browser.context.new_cdp_session(browser)

    def touch(*places, down=0):
        for k, fingers in enumerate(places):
            height = y + 40 - down * k
            points = [{"x": x + a, "y": height, "id": i} for i, a in enumerate(fingers)]
            kind = "touchMove" if k else "touchStart"
            tools.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        tools.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        return browser.evaluate(PIXELS)

    before = browser.evaluate(PIXELS)
    pinched = touch((40, 60), (30, 70), (20, 80), (10, 90))
    assert pinched[0] > before[0], "nearer"
    turned = touch((40,), (65,), (90,), (115,))
    assert turned[1] != pinched[1]
    scrolled = browser.evaluate("scrollY")
    assert touch((40,), (41,), (42,), (43,), down=10) == turned, "it scrolls, and tilts nothing"
    assert browser.evaluate("scrollY") > scrolled


def test_on_paper_stills_are_shown_and_nothing_is_cut_off(browser, written):
    show(browser, written, 1040)  # a landscape A4 page within its margins
    browser.emulate_media(media="print")
    wide = browser.evaluate(
        "[...document.querySelectorAll('main *')].filter(e => "
        "e.getBoundingClientRect().right > innerWidth + 1).map(e => e.outerHTML.slice(0, 80))"
    )
    stills = browser.evaluate(VISIBLE)
    browser.emulate_media(media="screen")
    assert wide == []
    assert stills == [[True, False]] * len(stills)
