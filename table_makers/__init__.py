"""Makers of the tables that are shipped with the package, from its own exact solvers: minutes each, seldom run."""
