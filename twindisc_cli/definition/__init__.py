"""Test definitions: read, checked, in SI units, and written back."""

from twindisc_cli.definition.load import load, load_text
from twindisc_cli.definition.record import Test
from twindisc_cli.definition.write import dump, relocate

__all__ = ["Test", "dump", "load", "load_text", "relocate"]
