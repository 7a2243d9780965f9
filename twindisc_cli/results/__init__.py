"""Results: the records a command returns, and how they are written."""

from twindisc_cli.results.result import Array, Axis, Dataset, Result, or_null

__all__ = ["Array", "Axis", "Dataset", "Result", "or_null"]
