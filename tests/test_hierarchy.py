"""Repeats and regimes: published tables, closed forms of balanced designs, and coverage over many draws."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import chdtrc, fdtrc

from twindisc_cli.identify import hierarchy
from twindisc_cli.identify.hierarchy import cells_of, levels, outliers, pool, wander
from twindisc_cli.identify.regimes import find_break, regimes

# 13 trials of the BCG vaccine, cases and others of the vaccinated and of the control group: G. A. Colditz et al., JAMA
# 271 (1994) 698-702, as printed with what follows from them in the documentation of metafor (W. Viechtbauer, J. Stat.
# Software 36 (2010) 3), and, for the odds, on its page about H. C. van Houwelingen et al., Stat. Med. 21 (2002).
BCG = np.array([
    [4, 119, 11, 128], [6, 300, 29, 274], [3, 228, 11, 209], [62, 13536, 248, 12619], [33, 5036, 47, 5761],
    [180, 1361, 372, 1079], [8, 2537, 10, 619], [505, 87886, 499, 87892], [29, 7470, 45, 7232], [17, 1699, 65, 1600],
    [186, 50448, 141, 27197], [5, 2493, 3, 2338], [27, 16886, 29, 17825],
], dtype=float)  # fmt: skip


def log_risk_ratios():
    cases, others, control, rest = BCG.T
    y = np.log(cases / (cases + others) / (control / (control + rest)))
    return y, np.sqrt(1.0 / cases - 1.0 / (cases + others) + 1.0 / control - 1.0 / (control + rest))


def log_odds_ratios():
    cases, others, control, rest = BCG.T
    return np.log(cases * rest / (others * control)), np.sqrt(np.sum(1.0 / BCG, axis=1))


def test_a_published_table_is_met(monkeypatch):
    monkeypatch.setattr(hierarchy, "CONFIDENCE", 0.95)
    y, s = log_risk_ratios()
    assert (y[0], s[0] ** 2) == (pytest.approx(-0.8893, abs=5e-5), pytest.approx(0.3256, abs=5e-5))
    found = pool(y, s)
    assert found.between**2 == pytest.approx(0.3132, abs=5e-5)
    assert found.mean == pytest.approx(-0.7145, abs=5e-5)
    assert found.std == pytest.approx(0.1808, abs=5e-5)  # Hartung and Knapp's
    assert (found.low, found.high) == (pytest.approx(-1.1084, abs=1e-4), pytest.approx(-0.3206, abs=1e-4))
    assert found.p_one == pytest.approx(chdtrc(12, 152.2330), rel=1e-3)


def test_the_interval_of_the_scatter_is_the_published_one(monkeypatch):
    monkeypatch.setattr(hierarchy, "CONFIDENCE", 0.95)
    found = pool(*log_odds_ratios())
    squared = (found.between_low**2, found.between_high**2)
    assert squared == (pytest.approx(0.1302, abs=1e-4), pytest.approx(1.1812, abs=1e-4))


def balanced(rng, tests=8, cells=10, between=0.03, within=0.01):
    test, cell = np.divmod(np.arange(tests * cells), cells)
    curve = np.log(np.linspace(0.4, 0.6, cells))
    y = curve[cell] + between * rng.standard_normal(tests)[test] + within * rng.standard_normal(len(test))
    return y, test, cell


def test_a_balanced_design_has_the_closed_forms_of_the_analysis_of_variance():
    y, test, cell = balanced(np.random.default_rng(1))
    table = y.reshape(8, 10)
    found = levels(y, test, cell)
    rest = table - table.mean(axis=0) - table.mean(axis=1, keepdims=True) + table.mean()
    assert found.level == pytest.approx(table.mean(axis=1) - table.mean(), abs=1e-12)
    assert found.cells == pytest.approx(table.mean(axis=0), abs=1e-12)
    assert found.std == pytest.approx(found.within / np.sqrt(10.0))
    assert found.dof == 63
    assert found.within**2 == pytest.approx(np.sum(rest**2) / 63)
    pooled = pool(found.level, found.std, found.dof)
    variance = np.var(found.level, ddof=1)
    assert pooled.between**2 == pytest.approx(variance - found.within**2 / 10)
    assert pooled.p_one == pytest.approx(fdtrc(7, 63, variance / (found.within**2 / 10)), rel=1e-9)
    assert pooled.std == pytest.approx(np.sqrt(variance / 8))


def test_one_value_for_all_is_refused_by_chance_only_as_often_as_it_says():
    rng = np.random.default_rng(2)
    p = []
    for _ in range(400):
        found = levels(*balanced(rng, between=0.0))
        p.append(pool(found.level, found.std, found.dof).p_one)
    assert np.mean(np.array(p) < 0.1) == pytest.approx(0.1, abs=0.045)  # three standard errors
    assert np.median(p) == pytest.approx(0.5, abs=0.1)


def test_gaps_and_other_creepages_do_not_move_the_level_of_a_test():
    y, test, cell = balanced(np.random.default_rng(3), between=0.1, within=0.0)
    kept = (test != 2) | (cell < 3)
    whole, some = levels(y, test, cell), levels(y[kept], test[kept], cell[kept])
    assert some.level == pytest.approx(whole.level, abs=1e-9)
    assert levels(y[:20], test[:20], np.arange(20)) is None


def test_creepages_a_little_apart_are_one():
    cell, mean = cells_of(np.array([2.0, 0.5, 0.505, 1.0, 2.01]))
    assert cell.tolist() == [2, 0, 0, 1, 2]
    assert mean == pytest.approx([0.5025, 1.0, 2.005])


def test_scatter_between_repeats_is_in_its_interval_and_the_outlier_is_named():
    """Eight repeats with 3 % scatter in mu, one of them an outlier by 25 %, over 100 draws."""
    rng = np.random.default_rng(4)
    held = named = 0
    for _ in range(100):
        y, test, cell = balanced(rng)
        y = y + np.where(test == 5, np.log(1.25), 0.0)
        found = levels(y, test, cell)
        out = outliers(found.level, found.std)
        named += out == [5]
        kept = np.setdiff1d(np.arange(8), out)
        pooled = pool(found.level[kept], found.std[kept], found.dof)
        held += pooled.between_low <= 0.03 <= pooled.between_high
    assert held >= 85
    assert named >= 85


def test_without_an_outlier_none_is_named():
    rng = np.random.default_rng(5)
    wrong = sum(bool(outliers(0.03 * rng.standard_normal(8), np.full(8, 0.003))) for _ in range(300))
    assert wrong / 300 <= 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / 300)


# Regimes


def test_a_line_breaks_by_chance_as_often_as_it_says():
    rng = np.random.default_rng(6)
    x = np.sort(rng.uniform(0.0, 4.0, 30))
    p = [find_break(x, 1.0 + 0.5 * x + 0.2 * rng.standard_normal(30), rng)[1] for _ in range(200)]
    assert np.mean(np.array(p) <= 0.1) == pytest.approx(0.1, abs=0.065)


def test_a_break_is_found_where_it_is():
    """Mild wear in proportion to T gamma / A, then severe wear at one rate (Braghin et al., Wear 261 (2006) 1253)."""
    rng = np.random.default_rng(7)
    x = np.log(np.geomspace(0.5, 60.0, 40))
    exact = np.where(x < np.log(10.4), np.log(5.3) + x, np.log(55.0))
    mild, severe = regimes(x, exact + 0.1 * rng.standard_normal(40), rng)
    assert mild.high < severe.low
    assert np.exp(severe.low) == pytest.approx(10.4, rel=0.3)
    assert (mild.slope, severe.slope) == (pytest.approx(1.0, abs=0.1), pytest.approx(0.0, abs=0.2))
    assert np.isnan(mild.p_value)
    assert severe.p_value <= 0.01


def test_few_or_equal_places_have_one_regime():
    rng = np.random.default_rng(8)
    assert len(regimes(np.arange(7.0), rng.standard_normal(7), rng)) == 1
    assert len(regimes(np.ones(20), rng.standard_normal(20), rng)) == 1
    assert regimes(np.arange(20.0), 2.0 * np.arange(20.0), rng)[0].slope == pytest.approx(2.0)


def test_levels_without_order_are_shrunk_to_their_mean_as_reml_pools_them():
    rng = np.random.default_rng(4)
    y, s = 0.05 * rng.standard_normal(4), np.full(4, 0.02)
    found, pooled = wander(y, s, np.arange(4)), pool(y, s)
    assert found.correlation == 0.0, "fewer than five levels tell nothing of their order"
    assert found.between == pytest.approx(pooled.between, rel=0.1)
    assert found.mean == pytest.approx(pooled.mean)
    share = found.between**2 / (found.between**2 + 0.02**2)
    assert found.level(np.arange(4))[0] == pytest.approx(pooled.mean + share * (y - pooled.mean))
    (drawn,), (std,) = found.level(np.inf)
    assert drawn == pytest.approx(pooled.mean)
    assert std == pytest.approx(np.sqrt(found.between**2 + (found.between**2 + 0.02**2) / 4))


def test_a_level_that_wanders_is_known_from_its_neighbours_and_one_that_does_not_is_not():
    """Of fifty walks the level left out is met by its neighbours within its interval; white levels show no order."""
    rng, inside, shown, false = np.random.default_rng(5), 0, 0, 0
    for _ in range(50):
        walk = np.cumsum(0.01 * rng.standard_normal(20))
        y = walk + 0.002 * rng.standard_normal(20)
        kept = np.arange(20) != 9
        found = wander(y[kept], np.full(19, 0.002), np.arange(20)[kept])
        (middle,), (std,) = found.level(9)
        inside += abs(middle - walk[9]) < 1.645 * std
        shown += found.p_order < 0.05
        assert std < np.std(y)
        false += wander(0.02 * rng.standard_normal(20), np.full(20, 0.002), np.arange(20)).p_order < 0.05
    assert 39 <= inside <= 50
    assert shown >= 48
    assert false <= 7
