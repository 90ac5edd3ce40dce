"""Bekker's pressure and the shear of Janosi and Hanamoto as a law of its own, for comparison with the built-in one.

[module]
name = "law-bekker-python"
kind = "law"
version = "1.0.0"
can = "pressure shear"

[parameters]
n = { default = 1.0, help = "exponent" }
k_c = { default = 1400.0, help = "cohesive modulus, N/m^(n+1)" }
k_phi = { default = 820e3, help = "frictional modulus, N/m^(n+2)" }
c_pa = { unit = "Pa", default = 170.0, help = "cohesion" }
phi_rad = { unit = "rad", default = 0.61, help = "angle of friction" }
K_m = { unit = "m", default = 0.018, min = 0.0, above_min = true, help = "shear modulus" }
"""
import math


def pressure(law, nodes, out):
    k = law.k_c / nodes.b + law.k_phi
    for i, z in enumerate(nodes.depth):
        p = out.pressure[i] = k * z ** law.n
        out.slope[i] = law.n * p / z


def shear(law, nodes, out):
    mu = math.tan(law.phi_rad)
    for i, (sigma, slip) in enumerate(zip(nodes.pressure, nodes.slip)):
        strength, mobilised = law.c_pa + mu * sigma, -math.expm1(-slip / law.K_m)
        out.stress[i] = strength * mobilised
        out.by_pressure[i] = mu * mobilised
        out.by_slip[i] = strength * (1.0 - mobilised) / law.K_m
