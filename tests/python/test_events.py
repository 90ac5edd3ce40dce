"""Events of FMI 3.0 in event mode: at times that the FMU announces, and where discrete inputs change."""

import pytest
from cfmu import build, build_3, described
from conftest import recorded, terraglue

EVENT_MODE = 'hasEventMode="true"'
EVERY_STEP = "[recording]\nevery_steps = 1\n"
MODES = "int fmi3EnterEventMode(Fmu *u) { u->mode = 5; return 0; }\nint fmi3EnterStepMode(Fmu *u) { u->mode = 3; return 0; }\n"
UPDATE = """int fmi3UpdateDiscreteStates(Fmu *u, bool *again, bool *end, bool *nominals, bool *values, bool *defined, double *next) {
    double (*v)[64] = u->v; *again = *end = *nominals = *values = *defined = false; %s return 0; }
"""
# x is the time, and 100 more for each event; the next one is a tenth of a second after the last
JUMPS = "if (v[3][0] >= v[2][0]) { v[1][0] += 100; v[2][0] += 0.1; } *defined = true; *next = v[2][0];"
TIMED = [("x", "output", "", ()), ("next", "local", "", ()), ("now", "local", "", ())]


def timed(folder, update=JUMPS, first=0.15):
    step = "v[1][0] += h; v[3][0] = t + h; if (v[3][0] > v[2][0] + 1e-9) return 3;"
    return build_3(folder, "timed", TIMED, step, start=f"v[2][0] = {first};", more=MODES + UPDATE % update, flags=EVENT_MODE)


def rows(done):
    assert done.returncode == 0, done.stderr
    return [[float(x) for x in line.split(",")] for line in done.stdout.splitlines()[1:]]


@pytest.mark.parametrize("step", [0.1, 0.05, 0.04, 0.3])
def test_an_event_that_the_fmu_announces_is_met_at_its_time(tmp_path, step):
    fmu = timed(tmp_path)
    found = rows(terraglue("fmu", "run", fmu, "--event-mode", "on", "--step", step, "--stop", "1.2"))
    # an event at a communication point belongs to the step that ends there
    count = lambda t: max(0, int((t - 0.15) / 0.1 + 1 + 1e-9))
    assert [x for _, x, _ in found] == pytest.approx([t + 100 * count(t) for t, _, _ in found], abs=1e-9)
    assert sum(events for _, _, events in found) == 11
    text = f'[time]\nstep_s = {step}\nduration_s = 1.2\n{EVERY_STEP}[timed]\nfmu = "timed.fmu"\nevent_mode = true\n'
    done, inside = recorded(tmp_path, text)
    assert done.returncode == 0, done.stderr
    assert [float(row["timed.x"]) for row in inside] == [x for _, x, _ in found]


def test_an_event_survives_going_back(tmp_path):
    # each step is discarded first, so that its halves begin from the state before it
    fmu = build_3(tmp_path, "timed", TIMED, "if (h > 0.06) return 2; v[1][0] += h; v[3][0] = t + h;", start="v[2][0] = 0.15;",
                  more=MODES + UPDATE % JUMPS, flags=EVENT_MODE)
    found = rows(terraglue("fmu", "run", fmu, "--event-mode", "on", "--step", "0.1", "--stop", "0.4"))
    assert [x for _, x, _ in found] == pytest.approx([0, 0.1, 100.2, 200.3, 300.4])


@pytest.mark.parametrize("time", ["NAN", "v[3][0] - 1"])
def test_a_time_that_no_event_can_have_is_an_error(tmp_path, time):
    fmu = timed(tmp_path, f"*defined = v[3][0] > 0.1; *next = *defined ? {time} : 0.15; *defined = true;")
    done = terraglue("fmu", "run", fmu, "--event-mode", "on", "--step", "0.1", "--stop", "0.4")
    assert done.returncode == 1 and "fmi3UpdateDiscreteStates" in done.stderr and "next event" in done.stderr, done.stderr


@pytest.mark.parametrize("before", [5e-11, 1e-13])
def test_an_event_shortly_before_a_communication_point_is_not_stepped_over(tmp_path, before):
    jumps = JUMPS.replace("+= 0.1;", "+= 9;")
    step = "if (t + h > v[2][0]) return 3; v[1][0] += h; v[3][0] = t + h;"
    fmu = build_3(tmp_path, "timed", TIMED, step, start=f"v[2][0] = 0.1 - {before};", more=MODES + UPDATE % jumps, flags=EVENT_MODE)
    done = terraglue("fmu", "run", fmu, "--event-mode", "on", "--step", "0.1", "--stop", "0.3")
    assert [x for _, x, _ in rows(done)] == pytest.approx([0, 100.1, 100.2, 100.3]) and "warning" not in done.stderr, done.stderr


def test_events_without_end_are_an_error(tmp_path):
    step = "v[1][0] += h; v[3][0] = t + h;"
    fmu = build_3(tmp_path, "timed", TIMED, step, more=MODES + UPDATE % "*defined = true; *next = v[3][0] + 1e-12;", flags=EVENT_MODE)
    done = terraglue("fmu", "run", fmu, "--event-mode", "on", "--step", "0.1", "--stop", "0.3")
    assert done.returncode == 1 and "at an event that was announced" in done.stderr, done.stderr


def test_an_fmu_with_steps_of_one_length_has_its_events_at_their_ends(tmp_path):
    step = "v[1][0] += 0.1; v[3][0] = t + h;"
    fmu = build_3(tmp_path, "timed", TIMED, step, start="v[2][0] = 0.15;", more=MODES + UPDATE % JUMPS, flags=EVENT_MODE)
    fmu = described(tmp_path, fmu, ('canHandleVariableCommunicationStepSize="true"', 'canHandleVariableCommunicationStepSize="false"'))
    done = terraglue("fmu", "run", fmu, "--event-mode", "on", "--step", "0.1", "--stop", "0.4")
    assert [x for _, x, _ in rows(done)] == pytest.approx([0, 0.1, 100.2, 200.3, 300.4])
    assert done.stderr.count("handled at the end of the step") == 1, done.stderr


def test_an_fmu_that_asks_for_the_end_at_the_start_makes_no_step(tmp_path):
    fmu = build_3(tmp_path, "ends", TIMED, "return 3;", more=MODES + UPDATE % "*end = true;", flags=EVENT_MODE)
    done = terraglue("fmu", "run", fmu, "--event-mode", "on", "--step", "0.1", "--stop", "0.4")
    assert done.returncode == 0 and "asked for the end of the run at t = 0 s" in done.stderr, done.stderr
    done, _ = recorded(tmp_path, '[time]\nstep_s = 0.1\nduration_s = 0.4\n[ends]\nfmu = "ends.fmu"\nevent_mode = true\n')
    assert done.returncode == 1 and "asks for the end" in done.stderr, done.stderr


def counting(folder, kind='causality="input" variability="discrete"'):
    """An FMU that takes its discrete input in event mode only, and counts the events in which it does."""
    refuses = 'if (*r == 5 && u->mode == 3) return no(u, "a discrete input is set in event mode");'
    discrete = f'<Float64 name="d" valueReference="5" {kind} start="0"/>'
    count = UPDATE % "if (v[5][0] != v[4][0]) { v[1][0] += 1; v[4][0] = v[5][0]; }"
    return build_3(folder, "counting", [("n", "output", "", ())], "", more=MODES + count, flags=EVENT_MODE, others=discrete, sets=refuses)


@pytest.mark.parametrize("kind", ['causality="input" variability="discrete"', 'causality="parameter" variability="tunable"'])
def test_a_discrete_input_that_changes_is_an_event(tmp_path, kind):
    fmu = counting(tmp_path, kind)
    (tmp_path / "in.csv").write_text("time,d\n0,1\n0.2,2\n0.3,2\n0.4,1\n")
    found = rows(terraglue("fmu", "run", fmu, "--event-mode", "on", "--step", "0.1", "--stop", "0.5", "--input", tmp_path / "in.csv"))
    # the value of the start is set in initialisation
    assert [n for _, n, _ in found] == [1, 1, 1, 2, 2, 3]
    assert [events for _, _, events in found] == [0, 0, 0, 1, 0, 1]
    text = '[time]\nstep_s = 0.1\nduration_s = 0.5\n' + EVERY_STEP + '[counting]\nfmu = "counting.fmu"\nevent_mode = true\n[[event]]\nat_s = 0.2\nset = { "counting.d" = 7.0 }\n'
    done, inside = recorded(tmp_path, text)
    assert done.returncode == 0, done.stderr
    assert [float(row["counting.n"]) for row in inside] == [0, 0, 0, 1, 1, 1]


def test_clocks_may_tick_thousands_of_times_in_a_step(tmp_path):
    clock = '<Clock name="c" valueReference="9" causality="input" intervalVariability="constant" intervalDecimal="0.001"/>'
    more = MODES + UPDATE % "v[1][0] += 1;" + "int fmi3SetClock(Fmu *u, const unsigned *r, size_t k, const bool *x, size_t m) { return 0; }\n"
    fmu = build_3(tmp_path, "ticks", [("n", "output", "", ())], "", more=more, flags=EVENT_MODE, others=clock)
    found = rows(terraglue("fmu", "run", fmu, "--event-mode", "on", "--step", "2", "--stop", "4"))
    assert [events for _, _, events in found] == [0, 2000, 2000]


@pytest.mark.parametrize("how, words", [("text", "no ELF header"), ("half", "cut off")])
def test_a_check_looks_at_the_library(tmp_path, how, words):
    import zipfile
    fmu = build(tmp_path, "m", [("y", "output", 0.0, "")], "r[0] = t + h;")
    fmu = described(tmp_path, fmu, ("</Outputs>", '</Outputs><InitialUnknowns><Unknown index="1"/></InitialUnknowns>'))
    assert "no problem found" in terraglue("fmu", "check", fmu).stdout
    with zipfile.ZipFile(fmu) as old:
        entries = {name: old.read(name) for name in old.namelist()}
    library = next(name for name in entries if name.endswith(".so"))
    entries[library] = b"no library" if how == "text" else entries[library][:3000]
    with zipfile.ZipFile(fmu, "w") as new:
        for name, data in entries.items():
            new.writestr(name, data)
    done = terraglue("fmu", "check", fmu)
    assert done.returncode == 1 and library in done.stdout and words in done.stdout, done.stdout


def test_sizes_of_arrays_are_shown_by_the_names_of_their_parameters(tmp_path):
    fmu = build_3(tmp_path, "sized", [("A", "output", "", ("n", 2))], "", n=3)
    assert "Float64[n,2]" in terraglue("fmu", "info", fmu).stdout


def test_bytes_are_given_in_hexadecimal_digits(tmp_path):
    binary = '<Binary name="b" valueReference="6" causality="input" variability="discrete" start="00"/>'
    more = """int fmi3SetBinary(Fmu *u, const unsigned *r, size_t k, const size_t *s, const unsigned char *const *x, size_t m) {
        u->v[1][0] = s[0] ? 1000.0 * s[0] + x[0][0] : -1; return 0; }\n"""
    fmu = build_3(tmp_path, "bytes", [("y", "output", "", ())], "", more=more, others=binary)
    assert rows(terraglue("fmu", "run", fmu, "--start", "b=ff00a1", "--stop", "1", "--step", "1"))[-1][1] == 3255
    done = terraglue("fmu", "run", fmu, "--start", "b=0x1", "--stop", "1")
    assert done.returncode == 2 and "hexadecimal digits, as 00ff" in done.stderr, done.stderr
    done, inside = recorded(tmp_path, '[time]\nstep_s = 1.0\nduration_s = 1.0\n[bytes]\nfmu = "bytes.fmu"\nb = "0a"\n')
    assert done.returncode == 0 and float(inside[0]["bytes.y"]) == 1010, done.stderr


def test_a_loop_that_nobody_solves_is_warned_of(tmp_path):
    gain = "r[1] = 1.0 - 0.5 * r[0];"
    for name in "ab":
        build(tmp_path, name, [("u", "input", 0.0, ""), ("y", "output", 0.0, "")], gain, depends="1")
    text = '[time]\nstep_s = 0.01\nduration_s = 0.1\n[a]\nfmu = "a.fmu"\n[b]\nfmu = "b.fmu"\n'
    link = '[[connect]]\nfrom = "{}.y"\nto = "{}.u"\n{}\n'
    for key, warned in [("", True), ('order = "jacobi"', False), ('order = "iterate"', False)]:
        done, _ = recorded(tmp_path, text + link.format("a", "b", key) + link.format("b", "a", key))
        assert done.returncode == 0 and ("in a loop (ModelStructure)" in done.stderr) == warned, done.stderr
    done, _ = recorded(tmp_path, text + link.format("a", "b", ""))
    assert "in a loop" not in done.stderr


def test_an_fmu_alone_is_warned_of_a_step_of_another_length(tmp_path):
    fmu = build(tmp_path, "fixed", [("y", "output", 0.0, "")], "r[0] += h;", variable_step=False)
    fmu = described(tmp_path, fmu, ("<ModelVariables>", '<DefaultExperiment stepSize="60"/><ModelVariables>'))
    run = lambda step: terraglue("fmu", "run", fmu, "--step", step, "--stop", "240")
    assert "its description says 60 s" in run(1).stderr and "--step 60 fits" in run(1).stderr
    assert "its description says" not in run(60).stderr + run(120).stderr
