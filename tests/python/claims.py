"""Figures of our own simulations that sentences quote: in README, docs/ and the headers of scenarios.

Each claim names a file, its words with `{}` where a figure stands, and what measures it: a figure of tests/figures.tsv
(which `cargo xtask validate --quick --check-docs` holds against a measurement), or a run. A block between two marks is
made whole. `test_claims.py` holds both; `python tests/python/claims.py --write` (a part of `cargo xtask docs`) writes figures that have changed. A sentence whose words
do not hold any more, "it climbs", has to be changed by hand: say in words what a figure can show.
"""

import csv
import functools
import json
import re
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from conftest import ROOT, terraglue

TOLERANCE = 0.05
FIGURE = r"([−-]?\d+(?:\.\d+)?(?:e-?\d+)?)"


class Claim(NamedTuple):
    """Words of a file with one `{}` for each measure."""

    file: str
    words: str
    measures: tuple

    def pattern(self):
        # a sentence may go over the end of a line, in a comment too
        parts = [r"(?:\s|\n#)+".join(map(re.escape, part.split(" "))) for part in self.words.split("{}")]
        return re.compile(FIGURE.join(parts))

    def found(self, text):
        """The place of the words, which occur once."""
        places = list(self.pattern().finditer(text))
        if len(places) != 1:
            raise AssertionError(f"{self.file}: `{self.words}` stands there {len(places)} times, not once")
        return places[0]


def number(shown):
    return float(shown.replace("−", "-"))


def agrees(shown, measured):
    """To 5 % or the last digit that is shown."""
    digits, _, exponent = shown.partition("e")
    decimals = len(digits.partition(".")[2]) - int(exponent or 0)
    return abs(number(shown) - measured) <= max(TOLERANCE * abs(measured), 0.51 * 10.0**-decimals)


def printed(shown, measured):
    """The measured figure with as many decimals as are shown."""
    if "e" in shown:
        return re.sub(r"e([-+])0*", r"e\1", f"{measured:.{len(shown.partition('.')[2].partition('e')[0])}e}").replace("e+", "e")
    text = f"{measured:.{len(shown.partition('.')[2])}f}"
    return text.replace("-", "−") if "−" in shown else text


# Measures.

@functools.cache
def rows():
    """Names of the figures of tests/figures.tsv, their values and meanings."""
    with (ROOT / "tests/figures.tsv").open() as table:
        found = csv.DictReader(table, delimiter="\t", quoting=csv.QUOTE_NONE)
        return {row["id"]: (float(row["value"]), row["what"]) for row in found if row["value"] != "-"}


def figure(*names, scale=1.0):
    """The largest of these figures of tests/figures.tsv; a `*` stands for a part of a name."""

    def measure():
        patterns = [re.compile(re.escape(name).replace(r"\*", r"[^.]+") + "$") for name in names]
        values = [value for own, (value, _) in rows().items() if any(p.match(own) for p in patterns)]
        assert values, f"tests/figures.tsv has no figure {names}"
        return scale * max(values)

    return measure


def cases(*names):
    """How many cases these figures have looked at: the number behind the last "of"."""
    return lambda: sum(float(re.search(r"of (\d+)$", rows()[name][1])[1]) for name in names)


# Runs that claims ask for: scenario and options.
WANTED = []


@functools.cache
def started():
    """All of them, and the comparison of strategies, two at a time."""
    pool = ThreadPoolExecutor(2)
    return {key: pool.submit(simulated, *key) for key in dict.fromkeys(WANTED)} | {"strategies": pool.submit(compared)}


def simulated(scenario, options):
    """Summary and columns of a run."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        done = terraglue("run", f"scenarios/{scenario}.toml", "--csv", "--json", "--out", out, *options, timeout=900)
        assert done.returncode == 0, done.stderr
        rows = list(csv.reader((out / "variables.csv").open()))
    columns = {name: [float(row[k]) for row in rows[1:] if row[k]] for k, name in enumerate(rows[0]) if name and rows[-1][k]}
    return json.loads(done.stdout), columns


def of_run(scenario, options, read):
    """The value that `read` finds in summary and columns of a run."""
    WANTED.append((scenario, options))
    return lambda: read(*started()[scenario, options].result())


def last(scenario, name, *options):
    """A variable at the end."""
    return of_run(scenario, options, lambda _, columns: columns[name][-1])


def mean_from(scenario, name, begin_s, *options):
    """Mean of a variable from a time on."""

    def mean(_, columns):
        values = [x for t, x in zip(columns["t_s"], columns[name]) if t >= begin_s]
        return sum(values) / len(values)

    return of_run(scenario, options, mean)


STEEP = ("--set", "world.gravity_m_s2=[-3.833,0.0,-9.030]")
SHORT = ("--duration", "5")
ROVER = "scenarios/rover_slope.toml"
SOIL, LAWS, GLUING = "docs/soil.md", "docs/soil-laws.md", "docs/gluing.md"
WHEEL, RIG = "soil.*.wheel.integral.", "soil.*.rig."
PLATE_WHEEL = "soil.*.plate_wheel_10mm."

CLAIMS = [
    Claim("scenarios/plate_sinkage.toml", "the plates sink by 35 mm, to {} N and {} N.", (
        last("plate_sinkage", "bevameter.small_plate.contact_normal"), last("plate_sinkage", "bevameter.large_plate.contact_normal"))),

    Claim(ROVER, "the left front wheel slips by {}; at 23 degrees by {}, and it digs itself in", (
        mean_from("rover_slope", "soil.contact1.slip", 4.0, *SHORT), mean_from("rover_slope", "soil.contact1.slip", 4.0, *SHORT, *STEEP))),
    Claim(ROVER, "the left front wheel turns at {} rad/s", (mean_from("rover_slope", "rover.LF_wheel_drive.velocity", 2.0, *SHORT),)),

    Claim(SOIL, "R = 16 and 32 cells of 5, 10, 20 mm | within {}°", (figure("soil.automaton.cone.*"),)),
    Claim(SOIL, "twice the spacing first (`settle_at_start`) | within {}°", (figure("soil.automaton.cone.*.settled"),)),
    Claim(SOIL, "over the angle of repose, five bodies, three soils, walls without cohesion | + {}°",
          (figure("soil.automaton.print.*.rim", "soil.automaton.print.*.rim_standing"),)),
    Claim(SOIL, "a print 3 cm deep in lunar soil, walls with cohesion | {}°", (figure("soil.automaton.print.lunar_10mm.wall"),)),
    Claim(SOIL, "largest curvature at rest over κ_max | {}", (figure("soil.automaton.cone.*.curvature"),)),
    Claim(SOIL, "where material stays where it is pressed, against the integral, four wheels, soils and slips | sinkage {} %, pull {} % of the load",
          (figure("soil.automaton.wheel.integral.sinkage"), figure("soil.automaton.wheel.integral.pull"))),
    Claim(SOIL, "the same with the shifted peak | sinkage {} %, pull {} % of the load",
          (figure("soil.automaton.wheel.shifted.sinkage"), figure("soil.automaton.wheel.shifted.pull"))),
    Claim(SOIL, "against the integral, which knows no heap ahead | sinkage {} %, pull {} %",
          (figure("soil.automaton.wheel.moving.sinkage"), figure("soil.automaton.wheel.moving.pull"))),
    Claim(SOIL, "dragged both ways, twisted, unloaded and lifted | {} % of the path of the work",
          (figure("soil.balance.dragged", "soil.balance.reversed", "soil.balance.twisted", "soil.balance.unloaded", "soil.balance.lifted"),)),
    Claim(SOIL, "drift of whole runs of twelve ways of feet and wheels | {} % of the motors' work", (figure("soil.energy.*"),)),
    Claim(SOIL, "against the foot pressed straight down | {} %, {} % (bekker)",
          (figure("walk.soil-cellular-automaton.prints.slow"), figure("walk.soil-bekker.prints.slow"))),
    Claim(SOIL, "steps of 1 ms against 0.25 ms | {} %", (figure("walk.prints.step"),)),
    Claim(SOIL, "a wheel yawed by 15°, both soils, two grids | sinkages within {} %", (figure("soil.yaw.15.spread"),)),
    Claim(SOIL, "pressed: automaton against soil-bekker | {} %", (figure("soil.press.*.automaton"),)),
    Claim(SOIL, "against resistive force theory | {} %", (figure("soil.*.sphere.rft"),)),
    Claim(SOIL, "from plates alone: driven, sinkage and pull | {} %, {} N", (figure(PLATE_WHEEL + "driven.sinkage"), figure(PLATE_WHEEL + "driven.pull"))),
    Claim(SOIL, "the same braked, sinkage and force | {} %, {} %", (figure(PLATE_WHEEL + "braked.sinkage"), figure(PLATE_WHEEL + "braked.force"))),
    Claim(SOIL, "side slip, sinkage and side force | {} %, {} %", (figure(PLATE_WHEEL + "aside.sinkage"), figure(PLATE_WHEEL + "aside.force"))),

    Claim("docs/fmi.md", "of the two masses has grown by {} % with `linear`, by {} % with `derivatives`",
          tuple(figure(f"fmi.error_over_cost.two_mass_100s.{key}") for key in ("linear", "derivatives"))),
    Claim("docs/fmi.md", "--part behaviour` has {} runs of FMUs that misbehave",
          (cases(*(f"fmi.behaviour.{where}" for where in ("isolated", "same_process", "alone.isolated", "alone.same_process"))),)),

    Claim(LAWS, "sinkage, mm | {} | {} | {} |", tuple(figure(f"soil.grousers.{wheel}.slip_0.3.sinkage") for wheel in ("smooth", "grousers", "outer"))),
    Claim(LAWS, "pull, N | {} | {} | {} |", tuple(figure(f"soil.grousers.{wheel}.slip_0.3.pull") for wheel in ("smooth", "grousers", "outer"))),

    Claim(GLUING, "adds up: {} and {} µm in a second of a double pendulum at 1.25 ms",
          (figure("gluing.level.velocity.gap", scale=1e6), figure("gluing.level.acceleration.gap", scale=1e6))),
    Claim(GLUING, "0.2 leaves {} %.", (figure("gluing.level.velocity.stabilisation", "gluing.level.acceleration.stabilisation", scale=100.0),)),
    Claim(GLUING, "(1 % wrong: {} N after 100 steps)", (figure("gluing.wrong_start.alpha_0.8"),)),
    Claim(GLUING, "its six forces within {} of the largest at h = 25 µs, each within {} of itself at 7.5 µs",
          (figure("gluing.squeezer.multipliers"), figure("gluing.squeezer.each_multiplier"))),
    Claim(GLUING, "took at most {} evaluations a step at h = 10 ms and {} at 20 ms", (
        figure("gluing.six_feet.*.*.h0.01.most", "gluing.six_feet.*.*.h0.01.rock.most"), figure("gluing.six_feet.*.*.h0.02.most"))),
    Claim(GLUING, "stays within {} rad of the uncut one", (figure("gluing.double_pendulum.semi-implicit.against_uncut"),)),

    Claim("docs/rigid-body.md", "the tip is off by {} mm at 1 s; `generalized-alpha` errs by {} J at most ({} times less at half the step), {} mm.", (
        figure("rigid-body.chain8.energy-momentum.tip"), *(figure(f"rigid-body.chain8.generalized-alpha.{part}") for part in ("energy", "ratio", "tip")))),

    Claim(LAWS, "a disc under 5 to 200 N in two soils | {} %", (figure("soil.*.load_control"),)),
    Claim(LAWS, "sinkage {} %, pull {} % of the load on `soil-cellular-automaton` where material", (figure(WHEEL + "sinkage"), figure(WHEEL + "pull"))),
    Claim(LAWS, "with material that moves | sinkage {} %, pull {} %",
          (figure("soil.automaton.wheel.moving.sinkage"), figure("soil.automaton.wheel.moving.pull"))),
    Claim(LAWS, "sinkage {} %, pull {} %, load {} % on `soil-cellular-automaton` with", (figure(RIG + "sinkage"), figure(RIG + "pull"), figure(RIG + "load"))),
    Claim(LAWS, "the shifted peak, against the table | {} %, {} %",
          (figure("soil.automaton.wheel.shifted.sinkage"), figure("soil.automaton.wheel.shifted.pull"))),
    Claim(LAWS, "`bearing` {} %, `bekker` {} %, `reece` {} % rms", (figure("soil.fit.bearing"), figure("soil.fit.bekker"), figure("soil.fit.reece"))),
    Claim(LAWS, "60 → 100 mm: {} %, 100 → 60 mm: {} %", (figure("soil.fit.unseen_diameter.100mm"), figure("soil.fit.unseen_diameter.60mm"))),
    Claim(LAWS, "left out of twelve, the worst | {} %: this press", (figure("soil.fit.unseen_press"),)),
    Claim(LAWS, "seen at 0.23, 0.75 | sinkage {} %, pull {} N",
          (figure("soil.automaton.real_wheel.three.unseen.sinkage"), figure("soil.automaton.real_wheel.three.unseen.pull"))),
    Claim(LAWS, "the reverse | {} %, {} N", (figure("soil.automaton.real_wheel.two.unseen.sinkage"), figure("soil.automaton.real_wheel.two.unseen.pull"))),
    Claim(LAWS, "seen: sinkage {} %, pull {} N; unseen: {} %, {} N; rising", tuple(
        figure(f"soil.automaton.real_wheel.three.{part}") for part in ("seen.sinkage", "seen.pull", "unseen.sinkage", "unseen.pull"))),
]


# Blocks.

STRATEGIES = ["cooperative", "cooperative-compliant", "iterative", "xt-newton", "relaxed", "gauss-seidel", "jacobi"]
SOILS = ["soil-cellular-automaton", "soil-bekker"]


def compared():
    """Summaries of a walk by strategy and soil."""
    with tempfile.TemporaryDirectory() as folder:
        chosen = ("--strategies", ",".join(STRATEGIES), "--soils", ",".join(SOILS))
        done = terraglue("compare", "scenarios/moon_walk.toml", *chosen, "--duration", "2", "--quiet", "--out", Path(folder) / "out", timeout=900)
        assert done.returncode == 0, done.stderr
        summary = lambda s, soil: json.loads((Path(folder) / "out" / f"{s}_{soil}" / "summary.json").read_text())
        return {(s, soil): summary(s, soil) for s in STRATEGIES for soil in SOILS}


def strategies():
    """The table of docs/gluing.md."""
    runs = started()["strategies"].result()
    columns = {
        "evaluations of the robot": lambda s: f"{s['evaluations_mean']:.1f}",
        "of the soil": lambda s: f"{s['evaluations_soil_mean']:.1f}",
        "deepest print, mm": lambda s: f"{1e3 * s['max_sinkage_m']:.1f}",
        "mean print, mm": lambda s: f"{1e3 * s['mean_sinkage_m']:.1f}",
        "largest gap, mm": lambda s: "–" if s["max_gap_m"] is None else f"{1e3 * s['max_gap_m']:.2f}",
        "drift of the energies, % of the motors' work": lambda s: f"{100 * s['energies']['drift_j'] / s['energies']['turnover_j']:.2f}",
    }
    text = "| strategy | " + " | ".join(columns) + " |\n" + "|---" * (1 + len(columns)) + "|\n"
    for strategy in STRATEGIES:
        cells = [" / ".join(cell(runs[strategy, soil]) for soil in SOILS) for cell in columns.values()]
        text += f"| `{strategy}` | {' | '.join(cells)} |\n"
    return text


def stiffness():
    """How stiff a ground each strategy holds: the table of docs/gluing.md, of the figures `gluing.stiffness`."""
    factors = ["0.1", "1", "10", "100", "1000"]
    kappa = [re.search(r"kappa ([\d.]+)", rows()[f"gluing.stiffness.{factor}.cooperative"][1])[1] for factor in factors]
    text = "| strategy | " + " | ".join(f"× {f} (κ {float(k):.{0 if float(k) > 1 else 2}f})" for f, k in zip(factors, kappa)) + " |\n" + "|---" * 6 + "|\n"

    def cell(strategy, factor):
        value, what = rows()[f"gluing.stiffness.{factor}.{strategy}"]
        if "fails" in what:
            return "fails"
        evaluations = re.search(r"parts of it; ([\d.]+)", what)[1]
        return f"{value:.2g}, {evaluations}" if value > 1e-3 else f"< 1e-6, {evaluations}"

    for strategy in ["iterative", "cooperative-compliant", "xt-newton", "relaxed", "cooperative", "gauss-seidel", "jacobi"]:
        text += f"| `{strategy}` | {' | '.join(cell(strategy, factor) for factor in factors)} |\n"
    return text


def error_over_cost():
    """Errors and costs of the orders of connections: the table of docs/fmi.md, of the figures `fmi.error_over_cost`."""
    cases = {
        "two_mass": "two masses, m",
        "chain": "chain",
        "van_der_pol": "van der Pol pair, m",
        "drive": "drive, rad/s",
        "two_mass_held": "two masses, input held, m",
    }
    keys = {name: f'`order = "{name}"`' for name in ("jacobi", "structure", "iterate", "iterate-ends")}
    keys |= {name: f'`extrapolate = "{name}"`' for name in ("linear", "derivatives")}
    steps = ["20ms", "10ms", "5ms"]
    heads = ["case", "key", *(step.replace("ms", " ms") for step in steps), "order of the error"]
    text = f"| {' | '.join(heads)} |\n" + "|---" * len(heads) + "|\n"

    def cell(name):
        error, cost = rows()[name][0], rows()[f"{name}.cost"][0]
        shown = f"{error:.2f}" if error > 0.1 else f"{error:.1e}".replace("e-0", "e-") if error > 1e-12 else "< 1e-12"
        return f"{shown} at {cost:.0f}"

    for case, title in cases.items():
        for key, shown in keys.items():
            name = f"fmi.error_over_cost.{case}.{key}"
            if f"{name}.{steps[0]}" not in rows():
                continue
            order = f"{rows()[f'{name}.order'][0]:.1f}" if f"{name}.order" in rows() else "–"
            text += f"| {title} | {shown} | {' | '.join(cell(f'{name}.{step}') for step in steps)} | {order} |\n"
    return text


# (file, name of the marks) → function that makes it
BLOCKS = {
    ("docs/gluing.md", "moon_walk"): strategies,
    ("docs/gluing.md", "stiffness"): stiffness,
    ("docs/fmi.md", "error_over_cost"): error_over_cost,
}


def block(file, name, text):
    """The span of a block."""
    begin, end = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->"
    assert text.count(begin) == text.count(end) == 1, f"{file} has no block `{name}`"
    return text.index(begin) + len(begin), text.index(end)


def block_differs(shown, made):
    """The first line of a block whose words, or whose figures by more than 5 % or a digit, are others."""
    ours, theirs = shown.splitlines(), made.splitlines()
    if len(ours) != len(theirs):
        return f"{len(ours)} lines, {len(theirs)} made"
    for one, other in zip(ours, theirs):
        same = re.split(FIGURE, one)[::2] == re.split(FIGURE, other)[::2]
        if not same or not all(agrees(s, number(m)) for s, m in zip(re.findall(FIGURE, one), re.findall(FIGURE, other))):
            return f"shows `{one}`, made `{other}`"
    return None


def wrong(claim, text):
    """Figures of a claim that are shown otherwise than measured."""
    shown = claim.found(text).groups()
    measured = [measure() for measure in claim.measures]
    return [f"{claim.file}: `{claim.words}` shows {s}, measured {m:.4g}: run `cargo xtask docs`, or change the sentence"
            for s, m in zip(shown, measured, strict=True) if not agrees(s, m)]


def rewritten(claim, text):
    """The text with the measured figures."""
    place = claim.found(text)
    for k in reversed(range(len(claim.measures))):
        begin, end = place.span(k + 1)
        text = text[:begin] + printed(place[k + 1], claim.measures[k]()) + text[end:]
    return text


def write():
    for claim in CLAIMS:
        path = ROOT / claim.file
        text = path.read_text()
        new = rewritten(claim, text)
        if new != text:
            print(f"{claim.file}: {claim.words}")
            path.write_text(new)
    for (file, name), make in BLOCKS.items():
        text = (ROOT / file).read_text()
        begin, end = block(file, name, text)
        (ROOT / file).write_text(text[:begin] + make() + text[end:])


if __name__ == "__main__":
    if sys.argv[1:] != ["--write"]:
        sys.exit("usage: python tests/python/claims.py --write")
    write()
