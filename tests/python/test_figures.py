"""The figures of a run are those that they claim to be: energies, distances, prints; and the report shows them on any screen."""

import base64
import html.parser
import json
import math
import re
import shutil
import subprocess
import zlib

import pytest
from conftest import ROOT, terraglue

ASSETS = ROOT / "coordinator/page/assets"
PHONE = 390  # px


def run(folder, scenario, *arguments):
    process = terraglue("run", ROOT / "scenarios" / f"{scenario}.toml", "--out", folder, *arguments)
    assert process.returncode == 0, process.stderr
    page = (folder / "report.html").read_text()
    return json.loads((folder / "summary.json").read_text()), page, process.stdout


def data_of(page):
    return json.loads(page.split('id="data">')[1].split("</script>")[0].replace("<\\/", "</"))


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """Two seconds of the default walk: half a second of standing and a second of ramp among them."""
    return run(tmp_path_factory.mktemp("walk") / "out", "moon_walk", "--duration", "2")


@pytest.fixture(scope="module")
def plates(tmp_path_factory):
    return run(tmp_path_factory.mktemp("plates") / "out", "plate_sinkage", "--duration", "1")


def test_the_distance_asked_for_begins_after_stand_and_ramp(walk):
    summary, _, printed = walk
    # 0.15 m/s from 1.5 s on, and half of it on average in the second before; a step that was halved moves it by 4e-8
    assert summary["commanded_distance_m"] == pytest.approx(0.15 * (0.5 + 0.5), abs=1e-6)
    assert "m asked for" in printed


def test_electrical_energy_is_that_of_drives_with_losses(walk, plates):
    summary, page, printed = walk
    energies = summary["energies"]
    assert summary["energy_j"] == pytest.approx(energies["driving_j"] + energies["braking_j"])
    net = energies["driving_j"] - energies["braking_j"]
    assert net == pytest.approx(energies["work_j"], abs=0.01 * summary["energy_j"])
    assert summary["electrical_energy_j"] > summary["energy_j"] > 0, "losses come on top"
    ratio = summary["electrical_cost_of_transport"] / summary["cost_of_transport"]
    assert ratio == pytest.approx(summary["electrical_energy_j"] / summary["energy_j"])
    assert "electrical energy" in printed and "Electrical energy" in page
    ideal, page, printed = plates
    assert ideal["electrical_energy_j"] is None and ideal["energies"]["driving_j"] > 0
    assert "electrical" not in printed and "Electrical energy" not in page


def test_prints_are_told_by_their_median_and_spread(walk):
    summary, _, printed = walk
    depth = summary["print_depth"]
    assert depth["count"] >= 6
    assert 0 < depth["p10_m"] <= depth["median_m"] <= depth["p90_m"] <= summary["max_sinkage_m"]
    assert f"median of {depth['count']}" in printed
    assert 0.5 < summary["peak_force_over_weight"] < 10


def test_what_is_asked_first_stands_first(walk):
    _, page, _ = walk
    labels = re.findall(r"<dt>([^<]*)</dt>", page)
    first = ["Distance", "Energy per metre", "Energy balance", "Depth of the prints", "Peak force", "Real-time factor"]
    assert labels[:6] == first
    sections = re.findall(r'<section id="(\w+)">', page)
    assert sections[:2] == ["run", "figures"] and sections[-1] == "exchange"
    assert re.search(r'<section id="exchange"><h2>[^<]*</h2>\s*<details><summary>', page), "the data flow is folded"


def floats(text):
    return memoryview(base64.b64decode(text)).cast("f").tolist()


def test_a_plate_test_shows_pressure_over_sinkage(plates):
    _, page, _ = plates
    figures = {figure["id"]: figure for figure in data_of(page)["figures"]}
    (panel,) = figures["pressure"]["panels"]
    assert (panel["x"], panel["unit"]) == ({"quantity": "sinkage", "unit": "m"}, "Pa")
    assert len(panel["curves"]) == 2
    for curve in panel["curves"]:
        sinkage, pressure = floats(curve["x"]), floats(curve["y"])
        # pressed in by 5 mm at 10 mm/s after half a second
        assert sinkage[-1] == pytest.approx(0.005, abs=2e-4) and sinkage == sorted(sinkage)
        # p = k z^n with the n of LETE sand, 0.79 (models/soils.csv), for either plate
        k = min(range(len(sinkage)), key=lambda i: abs(sinkage[i] - 0.0025))
        exponent = math.log(pressure[-1] / pressure[k]) / math.log(sinkage[-1] / sinkage[k])
        assert exponent == pytest.approx(0.79, abs=0.02)


def test_curves_of_contacts_have_the_names_and_colours_of_the_map(plates):
    data = data_of(plates[1])
    legs = list(data["map"]["legs"])
    assert sorted(legs) == ["large_plate", "small_plate"]
    figures = {figure["id"]: figure for figure in data["figures"]}
    for panel in figures["pressure"]["panels"] + figures["contacts"]["panels"] + figures["forces"]["panels"][:1]:
        assert {curve["name"]: curve["colour"] for curve in panel["curves"]} == {name: k for k, name in enumerate(legs)}
    # which is which: on this soil the pressure below the smaller plate is larger
    last = {curve["name"]: floats(curve["y"])[-1] for curve in figures["pressure"]["panels"][0]["curves"]}
    assert last["small_plate"] > last["large_plate"]


def test_what_the_world_holds_has_no_force_over_its_weight(plates):
    summary, page, printed = plates
    assert summary["peak_force_over_weight"] is None
    assert "Peak force" not in page and "× the weight" not in printed


def test_plates_are_round_on_the_map_and_wheels_leave_bands(plates, tmp_path):
    marks = {mark["leg"]: mark for mark in data_of(plates[1])["map"]["marks"]}
    assert data_of(plates[1])["map"]["tracks"] == []
    widths = sorted(max(floats(m["x"])) - min(floats(m["x"])) for m in marks.values())
    assert widths == pytest.approx([0.05, 0.1], rel=0.01)
    _, page, _ = run(tmp_path / "out", "wheel_rig", "--duration", "0.8")
    wheel = data_of(page)["map"]
    (track,) = wheel["tracks"]
    assert wheel["marks"] == [] and track["width"] == pytest.approx(0.107, abs=0.02)
    x = floats(track["x"])
    assert x == sorted(x) and x[-1] - x[0] > 0.05


def unpacked(field):
    differences = memoryview(zlib.decompress(base64.b64decode(field["data"]))).cast("H")
    total, numbers = 0, []
    for difference in differences:
        total = (total + difference) & 0xFFFF
        numbers.append(total)
    return numbers


def test_the_pointer_tells_height_and_sinkage_of_a_node(walk):
    quickjs = pytest.importorskip("quickjs", reason="runs the script of the report's map")
    map_data = data_of(walk[1])["map"]
    nodes = map_data["nodes"]
    nx, ny = nodes["size"]
    for name in ("height", "sinkage"):
        nodes[name]["numbers"] = unpacked(nodes[name])
        assert len(nodes[name]["numbers"]) == nx * ny
    sinkage = nodes["sinkage"]["numbers"]
    deepest = max(range(nx * ny), key=sinkage.__getitem__)
    x = nodes["origin"][0] + nodes["spacing"] * (deepest % nx)
    y = nodes["origin"][1] + nodes["spacing"] * (deepest // nx)
    context = quickjs.Context()
    context.eval((ASSETS / "nodes.js").read_text().replace("export ", ""))
    context.eval(f"const nodes = {json.dumps(nodes)};")
    text = context.eval(f"groundText(nodes, {x + 0.2 * nodes['spacing']}, {y})")
    millimetres = 1e3 * (nodes["sinkage"]["low"] + nodes["sinkage"]["step"] * sinkage[deepest])
    metres = nodes["height"]["low"] + nodes["height"]["step"] * nodes["height"]["numbers"][deepest]
    assert millimetres > 5
    assert text.endswith(f"height {metres:.4f} m, sinkage {millimetres:.1f} mm".replace("-", "−")), text
    outside = context.eval("groundText(nodes, 100, 0)")
    assert outside == "x = 100.000 m, y = 0.000 m"
    assert context.eval("Array.from(summed(new Uint16Array([5, 65535, 2]))).join()") == "5,4,6"


class Tables(html.parser.HTMLParser):
    """Tables that no box around them lets scroll."""

    def __init__(self):
        super().__init__()
        self.open, self.loose = [], []

    def handle_starttag(self, tag, attrs):
        if tag not in ("meta", "br", "link", "input"):
            self.open.append((tag, dict(attrs).get("class") or ""))
        own = dict(attrs).get("class") or ""
        boxed = any({"wide", "scroll"} & set(classes.split()) for _, classes in self.open)
        # the facts are two columns of words that wrap
        if tag == "table" and "facts" not in own and not boxed:
            self.loose.append(own)

    def handle_endtag(self, tag):
        while self.open and self.open.pop()[0] != tag:
            pass


def test_nothing_has_a_width_that_a_phone_has_not(walk):
    _, page, _ = walk
    tables = Tables()
    tables.feed(page.split("<main>")[1].split("</main>")[0])
    assert tables.loose == [], "tables that cannot scroll"
    css = (ASSETS / "page.css").read_text()
    for box in (".scroll", ".wide"):
        assert re.search(re.escape(box) + r" \{[^}]*overflow-x: auto", css)
    for rule in re.findall(r"[^{}]*\{[^{}]*\}", css):
        for width in re.findall(r"(?<!max-)(?:^|[ ;{(])(?:min-)?width: (\d+)px", rule):
            assert int(width) < PHONE - 60 or "max-width: 100%" in rule, rule
        for least in re.findall(r"minmax\((\d+)px", rule):
            assert int(least) < 200, f"write minmax(min({least}px, 100%), …): {rule}"


MEASURE = """<iframe id=f style="width:390px;height:3000px;border:0"></iframe><pre id=wide></pre><script>
const f = document.getElementById("f");
f.onload = () => setTimeout(() => {
  const inside = f.contentDocument;
  document.getElementById("wide").textContent = "width " + inside.documentElement.scrollWidth;
}, 500);
f.srcdoc = PAGE;
</script>"""


@pytest.mark.parametrize("which", ["walk", "plates"])
def test_a_browser_of_the_width_of_a_phone_has_nothing_to_scroll_sideways(which, request, tmp_path):
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if not browser:
        pytest.skip("no browser here: test_nothing_has_a_width_that_a_phone_has_not reads the rules")
    page = request.getfixturevalue(which)[1].replace("<details>", "<details open>")
    frame = tmp_path / "frame.html"
    frame.write_text("<meta charset=utf-8>" + MEASURE.replace("PAGE", json.dumps(page).replace("</", "<\\/")))
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=5000", "--dump-dom"]
    shown = subprocess.run([*command, frame.as_uri()], capture_output=True, text=True, timeout=120).stdout
    found = re.search(r">width (\d+)<", shown)
    assert found, shown[-500:]
    assert int(found[1]) <= PHONE


def test_words_on_cards_are_no_larger_than_their_card(walk):
    _, page, _ = walk
    values = re.findall(r'<dd><b([^>]*)>([^<]*)</b>', page)
    words = [(kind, text) for kind, text in values if not re.search(r"\d", text)]
    assert ("not applicable" in [text for _, text in words]) and all(kind == ' class="word"' for kind, _ in words), words
    # 205 px, less the padding, for 14 letters
    size = int(re.search(r"\.card dd b\.word \{ font-size: (\d+)px", (ASSETS / "page.css").read_text())[1])
    assert 14 * 0.6 * size < 205 - 32


def test_no_force_is_shown_before_the_first_step(walk):
    """The soil bears the robot from the start; an unset input is not 0 N."""
    data = data_of(walk[1])
    figures = {figure["id"]: figure for figure in data["figures"]}
    total = figures["forces"]["panels"][1]["curves"][0]
    t, y = floats(data["times"][total["t"]]), floats(total["y"])
    assert len(t) == len(y) and 0 < t[0] <= 0.01 and y[0] > 0.5 * max(y[:20]), (t[:3], y[:3])
