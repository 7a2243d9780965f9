"""The forward model: a test definition and a set of effects give the predicted channels."""
