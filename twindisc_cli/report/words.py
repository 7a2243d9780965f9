"""Words and numbers of the report, the same on the page, in the figure and on the terminal."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

from twindisc_cli.effects import catalogue
from twindisc_cli.identify.regimes import Regime
from twindisc_cli.laws.covariates import covariate_of
from twindisc_cli.laws.quantities import QUANTITIES as CHANGED
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.terms import EffectTerm, Term, in_test
from twindisc_cli.quantities import for_reading

KIND: Mapping[str, str] = {
    "smooth": "a smooth trend",
    "levels": "another level at each creepage",
    "iterations": "jumps between iterations",
    "iterations, a span": "another level from one moment to another",
    "heat by iteration": "heat that jumps between iterations",
    "heat by iteration, a span": "heat from one moment to another",
    "wave": "a periodic course",
    "position in the step": "the same course within every step",
    "even": "symmetric about the middle of the track",
    "odd": "antisymmetric about the middle of the track",
    "bump": "a local bump or dent",
    "line": "a straight line under the profile",
    "stops": "another size at each recorded profile",
}
MOST_DIGITS = 10  # more than any instrument gives
EXACT, BELOW = 6, 1e-5
"""Digits of a value whose standard error is below this share of it."""
unit = for_reading


def channel_name(channel: str) -> str:
    """What a channel is called."""
    return channels()[channel].label


def covariate_name(covariate: str) -> str:
    """What a covariate is called."""
    return covariate_of(covariate).label


def term_name(term: Term) -> str:
    """What an effect or a law is called."""
    name = plain_name(term.name) if isinstance(term, EffectTerm) else law_name(term.quantity, term.covariate)
    return in_test(name, term.test)


def plain_name(label: str) -> str:
    """What an effect is called, as its explanation begins: `falling friction`."""
    title = catalogue()[label].explanation.partition(":")[0] if label in catalogue() else label.replace("_", " ")
    return title[:1].lower() + title[1:]


def law_name(quantity_: str, covariate: str) -> str:
    """What a law is called: `a change of the coefficient of friction with time`."""
    label = CHANGED[quantity_].label
    if covariate == "y_over_edge":
        return f"a change of {label.removesuffix(' across the track')} across the track"
    return f"a change of {label} with {covariate_of(covariate).label}"


def explanation(effect: str) -> str:
    """The explanation of an effect, without the shapes of arrays."""
    return re.sub(r",? \((?:set, )?point,?\)", "", catalogue()[effect].explanation)


def number(value: float, digits: int = 3) -> str:
    """A number with some significant digits; a dash where it is not known."""
    if not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    if not 1e-3 <= abs(value) < 1e5:
        mantissa, power = f"{value:.{digits - 1}e}".split("e")
        return f"{mantissa}e{int(power)}"
    return f"{value:.{max(0, digits - 1 - math.floor(math.log10(abs(value))))}f}"


def quantity(value: float, symbol: str, digits: int = 3) -> str:
    """A number with its unit."""
    return f"{number(value, digits)} {unit(symbol)}".strip()


def with_error(value: float, std: float, symbol: str = "1") -> str:
    """`0.412 ± 0.011`: the error with two digits, the value to the same decimal, the unit behind."""
    if not (math.isfinite(value) and math.isfinite(std) and std > 0.0):
        return quantity(value, symbol)
    if std < BELOW * abs(value):
        return f"{number(value, EXACT)} ± {number(std, 1)} {unit(symbol)}".rstrip()
    size = max(abs(value), std)
    power = 0 if 1e-3 <= size < 1e5 else math.floor(math.log10(size))
    decimals = max(0, 1 - math.floor(math.log10(std)) + power)
    pair = f"{value / 10.0**power:.{decimals}f} ± {std / 10.0**power:.{decimals}f}"
    return f"({pair})e{power} {unit(symbol)}".rstrip() if power else f"{pair} {unit(symbol)}".rstrip()


def apart(low: float, high: float) -> tuple[str, str]:
    """Both ends of an interval, with as many digits as distinguish them, and three at least."""
    digits = _digits(low, high)
    return number(low, digits), number(high, digits)


def with_interval(value: float, low: float, high: float) -> str:
    """A value with its interval, `0.451 (0.448 to 0.454)`, all with as many digits as distinguish the ends."""
    digits = _digits(low, high)
    return f"{number(value, digits)} ({number(low, digits)} to {number(high, digits)})"


def _digits(low: float, high: float) -> int:
    """How many digits distinguish the ends of an interval, three at least."""
    width, size = abs(high - low), max(abs(low), abs(high))
    if not (math.isfinite(width) and width > 0.0):
        return 3
    return min(max(3, 1 + math.ceil(math.log10(size / width))), MOST_DIGITS)


def percent(share: float) -> str:
    """A share in percent, without pretending to certainty."""
    if not math.isfinite(share):
        return "–"
    if share >= 0.995:
        return "> 99 %"
    return "< 1 %" if share < 0.005 else f"{100.0 * share:.0f} %"


def p_value(value: float) -> str:
    """`p = 0.03`, or `p < 0.001`."""
    return "p < 0.001" if value < 1e-3 else f"p = {value:.2g}"


def regimes_text(regimes: Sequence[Regime]) -> str:
    """Several regimes of what stands over T gamma / A [N/mm2], as logarithms, with their breaks."""
    breaks = ", ".join(f"{math.exp(r.low):.3g} N/mm² (p = {r.p_value:.2g})" for r in regimes[1:])
    return f"{len(regimes)} regimes over T gamma / A, from {breaks}"


def sentence(text: str) -> str:
    """The text with a capital letter."""
    return text[:1].upper() + text[1:]


def listed(items: Sequence[str], last: str = "and") -> str:
    """`a, b and c`."""
    several = list(items)
    if len(several) < 2:
        return "".join(several)
    return f"{', '.join(several[:-1])} {last} {several[-1]}"


def look_at(channel: str, covariate: str) -> str:
    """Where to look for the cause of an unexplained residual."""
    return channels()[channel].look_at.get(
        covariate, f"what changes with the {channels()[channel].covariate(covariate).label}"
    )
