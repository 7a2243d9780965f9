"""Inversion of measurements: friction from traction, wear coefficient from a profile, convection from a temperature."""
