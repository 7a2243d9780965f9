"""Laws learnt from data: a quantity of the model, at its stage, changed by a curve over one covariate.

    quantity  what is changed: multiplied by a factor, or shifted            (quantities.py)
    covariate what the change depends on                                     (covariates.py)
    shape     the curve: a formula with its parameters, or a table of places (shapes.py)

A law acts inside the forward model like an effect of the catalogue, and so reaches every channel.
"""
