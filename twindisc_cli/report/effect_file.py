"""A learnt law as an effect for the catalogue: one file, ready for a physicist's hand."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from textwrap import fill
from typing import Any

from twindisc_cli.effects._effect import FIRST_SEEN, Param
from twindisc_cli.laws.covariates import Column
from twindisc_cli.laws.law import Law, formula_text
from twindisc_cli.laws.shapes import SHAPES
from twindisc_cli.laws.trial import formula
from twindisc_cli.model.experiment import Experiment
from twindisc_cli.report.sentences import range_of, transfer_text
from twindisc_cli.report.words import channel_name, sentence
from twindisc_cli.version import __version__

WIDTH = 116  # of a line of a docstring in the house style
TIMED = (
    "time",
    "cycles",
    "energy",
    "sliding_distance",
    "time_in_step",
    "time_since_pause",
    "greatest_creepage",
    "direction",
)


def effect_file(name: str, law: Law, test: Experiment) -> str:
    """The text of an effect file that does what a law of a test does."""
    params, fixed = _params(law)
    source = f"learnt by twindisc close-loop {__version__} on the test {test.name} ({test.measured.provenance} data)"
    needs = [("temperature", law.covariate == "temperature"), ("time", law.covariate in TIMED)]
    return "\n".join(
        [
            _explanation(name, law, params),
            "from __future__ import annotations\n",
            *(["from typing import Any\n"] if law.shape else []),
            "import numpy as np\n",
            "from twindisc_cli.effects._effect import Effect, Param",
            "from twindisc_cli.effects._state import Floats, State\n",
            *(f"{key.upper()} = {value!r}" for key, value in fixed.items()),
            "\n",
            _apply(law, params, fixed),
            "\n",
            *(inspect.getsource(part).strip() + "\n\n" for part in _parts(law)),
            "EFFECT = Effect(",
            f'    stage="{law.stage}",',
            *([f'    channel="{law.of.channel}",'] if law.of.channel != FIRST_SEEN.get(law.stage) else []),
            "    params=(",
            *(_param(p) for p in params),
            "    ),",
            "    apply=apply,",
            *([] if isinstance(law.over, Column) else [f'    over="{law.covariate}",']),
            *(f"    needs_{what}=True," for what, needed in needs if needed),
            f'    source="{source}",',
            ")\n",
        ]
    )


def _params(law: Law) -> tuple[list[Param], dict[str, object]]:
    """The parameters of the effect, and what it holds fixed: origins and ends of a formula, the places of a curve."""
    if law.shape is None:
        meaning = "the learnt change, 1 as it was learnt"
        return [Param("strength", "1", 1.0, 0.0, 3.0, meaning, off=0.0)], {"at": law.at, "value": law.value}
    along = [law.parameters[law.over.key(name)] for name in SHAPES[law.shape].along]
    span = law.valid or (0.0, 2.0 * max(map(abs, along), default=1.0))
    trial = formula(
        law.quantity, law.covariate, law.shape, law.parameters, span, 10.0 * abs(law.parameters[law.of.size_key])
    )
    return list(trial.params), dict(trial.fixed)


def _explanation(name: str, law: Law, params: list[Param]) -> str:
    """The docstring of the file."""
    act = "times" if law.of.kind == "factor" else "plus"
    title = f"{sentence(name.replace('_', ' '))}: {law.of.label} changes with {law.over.label}."
    symbols = [f"    {law.over.symbol}  {law.over.label} [{law.over.unit}]"]
    symbols += [f"    {p.name}  {p.meaning} [{p.unit}]{_off(p)}" for p in params]
    left = f"Leaves behind, when it is missing: a residual of the {channel_name(law.of.channel)} that changes with it."
    valid = f"Valid for: {law.over.label} {range_of(law) or 'of the test it was learnt on'}; {transfer_text(law)}."
    lines = [fill(title, WIDTH), "", f"    {law.of.label} {act} {formula_text(law)}", "", *symbols, ""]
    return '"""' + "\n".join([*lines, fill(left, WIDTH), fill(valid, WIDTH)]) + '\n"""\n'


def _off(p: Param) -> str:
    return "" if p.off is None else f"; {p.off:g} switches the effect off"


def _apply(law: Law, params: list[Param], fixed: Mapping[str, object]) -> str:
    """The function of the effect."""
    across = law.covariate == "y_over_edge"
    keys = ", ".join(f"{p.name}: Floats" for p in params)
    lines = [f"def apply(s: State, *, {keys}) -> State:", f'    """Change {law.of.label}."""']
    if across:
        lines += ["    if s.surface is None:", "        return s"]
    lines.append(f"    x = {law.over.expression}")
    names = {p.name: f"{p.name}[..., None]" if across else p.name for p in params}
    names |= {key: key.upper() for key in fixed}
    if law.shape is None:
        less = " - 1.0" if law.of.kind == "factor" else ""
        lines.append(f"    change = {names['strength']} * (np.interp(x, AT, VALUE){less})")
    else:
        form = SHAPES[law.shape]
        given = {name: names[law.over.key(name)] for name in form.along} | {name: names[name] for name in form.pure}
        arguments = ", ".join(f"{name}={text}" for name, text in given.items())
        lines.append(f"    change = {names[law.of.size_key]} * {form.value.__name__}(np.nan_to_num(x), {arguments})")
    known = "np.isfinite(x)" + (f" & (np.abs(x) <= {law.over.reach!r})" if law.over.reach < float("inf") else "")
    scale = "" if law.of.scale == 1.0 else f" * {law.of.scale!r}"
    return "\n".join([*lines, f"    return {law.of.apply.__name__}(s, np.where({known}, change{scale}, 0.0))"])


def _parts(law: Law) -> list[Callable[..., Any]]:
    """The functions of the program that the effect is made of."""
    return [*([SHAPES[law.shape].value] if law.shape else []), law.of.apply]


def _param(p: Param) -> str:
    log = ", log=True" if p.log else ""
    bounds = f"start={p.start!r}, lower={p.lower!r}, upper={p.upper!r}"
    return f'        Param("{p.name}", "{p.unit}", off={p.off!r}, {bounds},\n              meaning="{p.meaning}"{log}),'
