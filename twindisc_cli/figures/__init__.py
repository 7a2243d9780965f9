"""Figures: a result as a matplotlib Figure; nothing is saved here."""
