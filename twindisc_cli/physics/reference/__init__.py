"""Closed forms that the tests hold the program against; no command needs them."""
