"""`check-module --sanitize` names file and line of faults that only a sanitizer sees."""

import subprocess

import pytest

from conftest import PROGRAM, terraglue
from test_plugins import made

LAW = "    *slope = z > 0.0 ? s->k : 0.0;\n    return z > 0.0 ? s->k * z : 0.0;"
FAULTS = {
    "heap-buffer-overflow": "double *p = malloc(2 * sizeof *p); p[(int)(z < 1e9) + 1] = z; volatile double y = p[0]; (void)y; free(p);",
    "heap-use-after-free": "double *p = malloc(sizeof *p); *p = z; free(p); volatile double y = *p; (void)y;",
    "signed integer overflow": "volatile int big = 2147483647; volatile int y = big + (z < 1e9); (void)y;",
    "data race": "static double shared; shared += z;",
}


def has(switch):
    done = subprocess.run(["cc", f"-fsanitize={switch}", "-shared", "-fPIC", "-x", "c", "-", "-o", "/dev/null"], input=b"int x;",
                          capture_output=True)
    return done.returncode == 0


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_told_by_file_and_line(tmp_path, fault):
    switch = {"data race": "thread", "signed integer overflow": "undefined"}.get(fault, "address")
    if not has(switch):
        pytest.skip(f"the compiler lacks -fsanitize={switch}")
    place, _ = made(tmp_path, "soil", "c")
    source = place / "my_soil.c"
    text = source.read_text()
    assert text.count(LAW) == 1
    source.write_text(text.replace(LAW, f"    {FAULTS[fault]}\n{LAW}"))
    line = source.read_text()[:source.read_text().index(FAULTS[fault])].count("\n") + 1
    process = terraglue("check-module", source, "--sanitize", "--only", "four-threads" if switch == "thread" else "steps")
    assert process.returncode == 1, process.stdout + process.stderr
    found = [row for row in process.stdout.splitlines() if fault in row]
    assert found and f"my_soil.c:{line}: " in found[0], process.stdout


# The tests that came across a fault of the header or a scaffold once.
TRIED = ["steps", "serialize", "odd-calls", "four-threads"]


@pytest.mark.parametrize("kind, language", [("soil", "c"), ("soil", "cpp"), ("law", "c"), ("law", "cpp")])
def test_a_new_module_has_no_fault(tmp_path, kind, language):
    place, _ = made(tmp_path, kind, language)
    process = terraglue("check-module", place, "--sanitize", *[word for test in TRIED for word in ("--only", test)])
    assert process.returncode == 0 and "0 found" in process.stdout, process.stdout + process.stderr


def test_a_compiler_without_sanitizers_is_a_skip_and_sources_that_do_not_compile_are_told(tmp_path):
    place, _ = made(tmp_path, "soil", "c")
    (place / "my_soil.c").write_text("int nothing = ;\n")
    process = terraglue("check-module", place, "--sanitize")
    assert process.returncode == 2 and "my_soil.c:1" in process.stderr.replace("\n", "")
    process = subprocess.run([PROGRAM, "check-module", place, "--sanitize"], capture_output=True, text=True,
                             env={"PATH": "/nonexistent"})
    assert "are not looked for" in process.stdout and "looked for: nothing" in process.stdout
