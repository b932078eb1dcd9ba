"""The complementary error function, made so that loops over it vectorise.

The C library's takes one number at a time, and a charge of an Ewald sum has hundreds of near ones.
Here erfc(x) = exp(-x^2) P(t), t = 1 - 5 / (x + 5/2), for x >= 0, and 2 - erfc(-x) below, with
P the Chebyshev expansion of exp(x^2) erfc(x) over t in [-1, 1], cut off below half a unit in its
last place and written in powers (Schonfelder 1978, with another scale). Its derivative is
-2 / sqrt(pi) exp(-x^2). Laws have ``wp.erfc`` translated to it (see ``precision.translate``).
"""

# ruff: noqa: F811, the function is overloaded

import math
from typing import Any

import warp as wp

from .exponential import DOUBLE, SINGLE

# Highest power first; found with 70 decimal digits.
SINGLE_POWERS = (
    3.4272459917e-06, 1.2148345535e-05, -2.9382336054e-05, -1.2127661510e-04, 2.2537797981e-04,
    8.7150711531e-04, -2.6413681709e-03, -3.9924425588e-03, 3.9922378387e-02, -1.2503320742e-01,
    2.5171320302e-01, -3.7173672847e-01, 2.1080636396e-01,
)  # fmt: skip
DOUBLE_POWERS = (
    -2.0072147665368737e-10, -8.549756722065723e-10, 8.585422008887033e-10, 8.113459080575267e-09,
    4.420687753555812e-09, -3.645083288178457e-08, -6.349092859659045e-08, 8.585918601469817e-08,
    3.927378539289941e-07, 7.708442121091479e-08, -1.818165263866752e-06, -2.2993718679350275e-06,
    7.555651703864549e-06, 1.8614912002909514e-05, -3.418261056105186e-05,
    -0.00012887725723621793, 0.00022838041065115734, 0.0008759154601589889,
    -0.0026423659662115125, -0.003993701166534247, 0.03992253907565586, -0.1250330523788077,
    0.2517131932174482, -0.37173673394897355, 0.2108063640611436,
)  # fmt: skip


def _value(c: str, exponential: str, powers: tuple[float, ...]) -> str:
    """C++ that finds ``e``, exp(-x^2), and ``tail``, erfc(|x|)."""
    steps = " ".join(f"p = p * t + ({c}){each!r};" for each in powers[1:])
    return f"""
    {c} e;
    const {c} size = x < ({c})0 ? -x : x;
    {{
        const {c} square = size * size;
        const {c} x = -square;
        {exponential}
        e = value;
    }}
    const {c} t = ({c})1 - ({c})5 / (size + ({c})2.5);
    {c} p = ({c}){powers[0]!r};
    {steps}
    const {c} tail = p * e;
"""


def _snippets(c: str, exponential: str, powers: tuple[float, ...]) -> tuple[str, str]:
    """Snippets of the function, and of its adjoint."""
    value, slope = _value(c, exponential, powers), -2.0 / math.sqrt(math.pi)
    return (
        value + f"    return x < ({c})0 ? ({c})2 - tail : tail;\n",
        value + f"    adj_x += adj_ret * e * ({c}){slope!r};\n",
    )


_S = _snippets("float", SINGLE, SINGLE_POWERS)
_D = _snippets("double", DOUBLE, DOUBLE_POWERS)


@wp.func_native(*_S)
def single(x: wp.float32) -> wp.float32: ...


@wp.func_native(*_D)
def double(x: wp.float64) -> wp.float64: ...


@wp.func
def complement(x: Any):
    return wp.erfc(x)


@wp.func
def complement(x: wp.float32):
    return single(x)


@wp.func
def complement(x: wp.float64):
    return double(x)
