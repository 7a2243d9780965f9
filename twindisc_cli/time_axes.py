"""What time can be drawn over, once: the choices of the command line, the labels of axes, the headers of tables."""

TIME_AXES = {
    "s": "time [s]",
    "min": "time [min]",
    "h": "time [h]",
    "cycles": "revolutions [1]",
    "km": "rolled distance [km]",
}
"""Labels, by what `--over` takes."""
