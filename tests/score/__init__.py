"""The public score: does the closed loop find what a twin-disc test hides?

A synthetic rig that shares no code with the program makes tests whose truth only this package knows: its own
Hertz contact, its own half-space contact at every wear step, its own traction laws, time stepping, heat balance
and sensors. The loop then runs on their files as a user would run it, and its answers are counted.

    contact    Hertz ellipse, numerical half-space contact with implicit wear
    traction   FASTSIM by quadrature over strips, the tabulated exact curve
    worn_patch what a worn patch transmits beyond its ellipse, by the exact theory on its own strips
    heat       temperature of the disc, shaft and thermocouple, in small Runge-Kutta steps
    rig        the rig in one record, and the march through its history
    effects    hidden effects that are in the program's catalogue, with formulas from the literature
    forms      near-misses: the same mechanisms by other formulas
    unknowns   random laws that are in no catalogue, and what a history can tell of them
    hiding     all that can be hidden, by name
    histories  drawn rigs: geometries, creepages, loads and speeds of the steps; the other history of a rig
    sensors    sampling, noise, drift, outliers, quantisation; the balance
    sizing     how large an effect is, in units of the detection threshold
    making     one test: definition, measured files, the other history, truth
    cases      which tests a score consists of
    judging    what is right in an answer
    scoring    runs the loop and counts
    figure     detection and attribution over effect size, and how often what is told as probable is right
"""
