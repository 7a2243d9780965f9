"""effects --test: the harness of the effects on a user's own file, a line for each check."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from twindisc_cli.effects import add_file, catalogue, effect_of
from twindisc_cli.effects._effect import Effect
from twindisc_cli.errors import NEGATIVE_FINDING, DefinitionError, Problem
from twindisc_cli.loop.effect_checks import Check, acting, declared, found_again, sound
from twindisc_cli.results import Dataset, Result


def run(path: Path, progress: Callable[[str, float], None]) -> Result:
    """Test the effect of a file; exit code 5 where a claim does not hold."""
    name, effect = path.stem, joined(path)
    result: list[Check] = []
    for part, checks in enumerate((declared, acting, sound, found_again)):
        progress(f"{name}: {checks.__name__.replace('_', ' ')}", part / 4)
        result += checks(name, effect)
        if part == 0 and not all(check.ok for check in result):
            break
    failed = sum(not check.ok for check in result)
    outcome = f"{name}: {len(result)} checks, {failed} failed" if failed else f"{name}: all {len(result)} checks hold"
    return Result(
        command="effects",
        summary=(outcome, *(str(check) for check in result)),
        json={"effect": name, "checks": [{"what": c.what, "ok": c.ok, "seen": c.seen} for c in result]},
        dataset=Dataset((), ()),
        figure=None,
        exit_code=NEGATIVE_FINDING if failed else 0,
    )


def joined(path: Path) -> Effect:
    """The effect of a file, which from here on is in the catalogue."""
    if not path.is_file():
        raise DefinitionError(Problem("no such file", path))
    built_in = catalogue().get(path.stem)
    if built_in is not None and Path(built_in.apply.__code__.co_filename).resolve() == path.resolve():
        return built_in
    effect = effect_of(path)
    add_file(path)
    return catalogue().get(path.stem, effect)
