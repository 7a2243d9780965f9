"""Test definitions: read, checked, in SI units, and written back."""

from twindisc_cli.definition.load import load, load_text
from twindisc_cli.definition.parse import parse_block
from twindisc_cli.definition.record import Test
from twindisc_cli.definition.write import dump, law_table, path_from, relocate, test_name

__all__ = ["Test", "dump", "law_table", "load", "load_text", "parse_block", "path_from", "relocate", "test_name"]
