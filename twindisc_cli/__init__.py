"""twindisc: friction, wear, temperature and missing physics of twin-disc tests."""

__version__ = "0.1.0"
