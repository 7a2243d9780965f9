"""Test definitions: read, checked, in SI units, and written back."""

from twindisc_cli.definition.load import load
from twindisc_cli.definition.record import Test
from twindisc_cli.definition.write import dump, relocate

__all__ = ["Test", "dump", "load", "relocate"]
