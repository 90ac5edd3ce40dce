"""The axes of reports: a value, its prefix and its unit together give the recorded quantity."""


import pytest
from conftest import ROOT

quickjs = pytest.importorskip("quickjs", reason="runs the script of the report's axes")
SCRIPT = (ROOT / "coordinator/page/assets/axes.js").read_text()
# the rest of the script needs a page
PREFIXES = SCRIPT[SCRIPT.index("// Power to which"):SCRIPT.index("/** A number as short")].replace("export ", "")
STEPS = {"M": 1e6, "k": 1e3, "": 1.0, "m": 1e-3, "µ": 1e-6, "n": 1e-9, "p": 1e-12, "f": 1e-15}


def prefix(magnitude, unit):
    context = quickjs.Context()
    context.eval(PREFIXES)
    symbol = context.eval(f"prefixFor({magnitude!r}, {unit!r}).symbol")
    return symbol, context.eval(f"prefixFor({magnitude!r}, {unit!r}).factor")


@pytest.mark.parametrize("unit, power", [("m", 1), ("Pa", 1), ("m/s^2", 1), ("N m", 1), ("m^2", 2), ("m²", 2), ("m^3", 3), ("s^2", 2)])
@pytest.mark.parametrize("magnitude", [3e7, 2500.0, 1.0, 0.2, 4e-3, 7e-4, 2e-5, 3e-9])
def test_a_prefix_is_raised_to_the_power_of_its_unit(unit, power, magnitude):
    symbol, factor = prefix(magnitude, unit)
    assert factor == pytest.approx(STEPS[symbol] ** power, rel=1e-12)
    assert magnitude / factor >= 0.09 or symbol == "f"


def test_the_area_of_a_foot_is_square_millimetres():
    assert prefix(7.1e-4, "m^2") == ("m", 1e-6)


@pytest.mark.parametrize("unit", ["", "1", "kg", "kg m^2", "kg/m^3", "%"])
def test_pure_numbers_and_kilograms_get_no_prefix(unit):
    assert prefix(2e-5, unit) == ("", 1)
