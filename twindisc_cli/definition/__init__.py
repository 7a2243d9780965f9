"""Test definitions: read, checked, in SI units, and written back."""

from twindisc_cli.definition.load import load, load_text
from twindisc_cli.definition.record import Test
from twindisc_cli.definition.write import dump, law_table, relocate

__all__ = ["Test", "dump", "law_table", "load", "load_text", "relocate"]
