"""The theory: pure functions of arrays, SI units, no files and no state."""
