"""Modules of the page one by one, in a real browser: they read the output of others."""

import base64
import json
import struct
import zlib

import pytest
from browser import opened
from conftest import ROOT

ASSETS = ROOT / "coordinator" / "page" / "assets"
EMPTY = """<!doctype html><div id=here style="width:600px"></div>
<script type="importmap">{ "imports": { "terraglue/": "./" } }</script>"""


def answer(route):
    name = route.request.url.rsplit("/", 1)[1]
    if not name:
        route.fulfill(body=EMPTY, content_type="text/html")
    elif (ASSETS / name).is_file():
        route.fulfill(body=(ASSETS / name).read_text(), content_type="text/javascript")
    else:
        route.fulfill(status=404)


@pytest.fixture(scope="module")
def page():
    """A page without anything that can import every module."""
    with opened() as page:
        page.route("http://page.test/**", answer)
        page.goto("http://page.test/")
        yield page


def test_every_module_can_be_imported(page):
    # these start a page when they are imported
    names = sorted(p.name for p in ASSETS.glob("*.js") if p.name not in ("live.js", "report.js", "theme.js", "video.js"))
    loaded = page.evaluate("async (names) => { for (const n of names) await import(`terraglue/${n}`); return names.length; }", names)
    assert loaded == len(names)


def message_type():
    descriptor_pb2 = pytest.importorskip("google.protobuf.descriptor_pb2")
    from google.protobuf import descriptor_pool, message_factory

    kinds = dict(d=1, f=2, i64=3, u64=4, i32=5, f64=6, f32=7, b=8, s=9, by=12, u32=13, sf32=15, sf64=16, s32=17, s64=18)
    file = descriptor_pb2.FileDescriptorProto(name="all.proto", package="some.place", syntax="proto3")
    inner = file.message_type.add(name="Outer").nested_type.add(name="Inner")
    inner.field.add(name="x", number=1, type=1, label=1)
    outer = file.message_type[0]
    for number, (name, kind) in enumerate(kinds.items(), start=1):
        outer.field.add(name=name, number=number, type=kind, label=1)
    outer.field.add(name="many", number=40, type=1, label=3)
    outer.field.add(name="words", number=41, type=9, label=3)
    outer.field.add(name="inner", number=2000, type=11, label=1, type_name=".some.place.Outer.Inner")
    outer.field.add(name="inners", number=2001, type=11, label=3, type_name=".some.place.Outer.Inner")
    # as seen from inside the message, without the whole name
    outer.field.add(name="near", number=2002, type=11, label=1, type_name="Outer.Inner")
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    made = message_factory.GetMessageClass(pool.FindMessageTypeByName("some.place.Outer"))
    return made, descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()


READ = """async ([schema, body]) => {
  const { decoder } = await import("terraglue/protobuf.js");
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const read = decoder(bytes(schema), "some.place.Outer");
  const out = read(bytes(body));
  out.by = Array.from(out.by);
  return out;
}"""


def test_messages_of_every_scalar_type_are_read(page):
    made, schema = message_type()
    values = dict(d=-1.5e300, f=0.25, i64=-(2**40), u64=2**52, i32=-7, f64=2**50, f32=4_000_000_000, b=True, s="größer", u32=3_000_000_000,
                  sf32=-5, sf64=-(2**45), s32=-123456, s64=-(2**44))
    message = made(**values, by=b"\x00\xff", many=[1.0, -2.5], words=["a", ""], inner={"x": 3.0}, near={"x": 4.0}, inners=[{"x": 1.0}, {}])
    text = [base64.b64encode(x).decode() for x in (schema, message.SerializeToString())]
    read = page.evaluate(READ, text)
    assert {name: read[name] for name in values} == values
    assert read["by"] == [0, 255] and read["many"] == [1.0, -2.5] and read["words"] == ["a", ""]
    assert read["near"] == {"x": 4.0}
    assert read["inner"] == {"x": 3.0} and read["inners"] == [{"x": 1.0}, {"x": 0}]
    empty = page.evaluate(READ, [text[0], ""])
    assert empty["d"] == 0 and empty["s"] == "" and empty["inner"] is None and empty["many"] == []


@pytest.mark.parametrize("cut", [1, 5, 20])
def test_a_message_that_ends_early_is_refused(page, cut):
    made, schema = message_type()
    body = made(s="some words that are cut", many=[1.0] * 9).SerializeToString()[:-cut]
    with pytest.raises(Exception, match="ends early|outside|bounds"):
        page.evaluate(READ, [base64.b64encode(x).decode() for x in (schema, body)])


def layer(rows):
    """Numbers of a tile as `/ground/tiles` holds them."""
    out, first = [], 0
    for row in rows:
        before = first
        for k, value in enumerate(row):
            out.append((value - before) & 0xFFFF)
            before = value
            first = value if k == 0 else first
    return struct.pack(f"<{len(out)}H", *out)


def test_tiles_of_the_ground_are_put_where_they_belong(page):
    heights = [[100, 90, 70], [65535, 0, 5]]
    sinkage = [[0, 65535, 3], [2, 2, 2]]
    body = zlib.compress(struct.pack("<I4H", 1, 2, 1, 3, 2) + layer(heights) + layer(sinkage))
    read = page.evaluate("""async (body) => {
      const { takeTiles } = await import("terraglue/frames.js");
      const loads = [];
      const relief = { lattice: { nx: 6, ny: 4 }, height: new Float32Array(24), sinkage: new Float32Array(24), load: (...a) => loads.push(a) };
      await takeTiles(new Uint8Array(body), relief, { z0: -1, dz: 0.5 });
      return { height: Array.from(relief.height), sinkage: Array.from(relief.sinkage), loads };
    }""", list(body))
    expected = [0.0] * 24
    for j, row in enumerate(heights):
        for i, value in enumerate(row):
            expected[(1 + j) * 6 + 2 + i] = -1 + 0.5 * value
    assert read["height"] == expected
    assert [read["sinkage"][6 + 2 + k] for k in range(3)] == [0, -0.5, 1.5], "heave is negative"
    assert read["loads"] == [[2, 1, 3, 2]]


def test_frames_of_an_answer_are_taken_one_by_one(page):
    body = b"".join(struct.pack("<IQI", k, 1_500_000_000 * k, len(b)) + b for k, b in enumerate([b"abc", b"", b"z"]))
    frames = page.evaluate("""async (body) => {
      const { eachFrame } = await import("terraglue/frames.js");
      const out = [];
      eachFrame(new Uint8Array(body).buffer, (id, t, bytes) => out.push([id, t, String.fromCharCode(...bytes)]));
      return out;
    }""", list(body))
    assert frames == [[0, 0, "abc"], [1, 1.5, ""], [2, 3, "z"]]


def test_a_table_of_curves_keeps_the_last_value_of_the_others(page):
    text = page.evaluate("""async () => {
      const { table } = await import("terraglue/export.js");
      const series = new Map([["a.x", { t: [0, 1], y: [1, 2] }], ["b.y", { t: [0.5], y: [NaN] }]]);
      return table(["a.x", "b.y"], series, (n) => (n === "a.x" ? "m" : ""));
    }""")
    assert text == "t (s),a.x (m),b.y\n0,1,\n0.5,1,\n1,2,\n"


def test_rotations_agree_with_their_matrices(page):
    worst = page.evaluate("""async () => {
      const m = await import("terraglue/math.js");
      let worst = 0;
      for (let k = 0; k < 50; k++) {
        const random = (n) => Array.from({ length: n }, () => Math.random() * 2 - 1);
        const q = m.between(random(4), random(4), 0.5);
        const [v, p] = [random(3), random(3)];
        const matrix = m.placed(p, q, [1, 1, 1]);
        const by = [0, 1, 2].map((r) => matrix[r] * v[0] + matrix[4 + r] * v[1] + matrix[8 + r] * v[2] + matrix[12 + r]);
        const turned = m.add(p, m.turn(q, v));
        worst = Math.max(worst, ...by.map((x, r) => Math.abs(x - turned[r])));
        const up = m.turn(m.upTo(v), [0, 0, 1]);
        worst = Math.max(worst, ...m.unit(v).map((x, r) => Math.abs(x - up[r])));
      }
      return worst;
    }""")
    assert worst < 1e-12


def test_the_pointer_sees_what_is_drawn_under_it(page):
    worst = page.evaluate("""async () => {
      const { Camera } = await import("terraglue/camera.js");
      const m = await import("terraglue/math.js");
      const camera = new Camera();
      let worst = 0;
      for (const name of ["follow", "side", "top", "front"]) {
        camera.choose(name);
        const sight = camera.sight(800, 500);
        const place = [0.3, 0.7];
        const point = m.add(sight.eye, m.times(sight.ray(place), 2.7));
        const seen = sight.project(point);
        worst = Math.max(worst, Math.abs(seen[0] - place[0]), Math.abs(seen[1] - place[1]));
      }
      return worst;
    }""")
    assert worst < 1e-6


def test_plots_keep_every_peak(page):
    path = page.evaluate("""async () => {
      const { Plot, TimeAxis } = await import("terraglue/plot.js");
      const t = Float32Array.from({ length: 20000 }, (_, k) => k * 1e-3);
      const y = t.map((_, k) => (k === 12345 ? 5 : Math.sin(k * 1e-3)));
      const plot = new Plot(document.getElementById("here"), { quantity: "x", unit: "m", log: null, curves: [{ name: "x", colour: 0, t, y }] }, new TimeAxis(0, 20), true);
      plot.draw();
      return [plot.pathOf(plot.curves[0]).length, plot.range[1]];
    }""")
    assert path[1] > 5 and path[0] < 60_000, json.dumps(path)
