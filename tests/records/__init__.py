"""The closed loop on records that nobody made up, beside a student with curve_fit and a Gaussian process.

sources   the records, as tests and as groups of tests
splits    which samples are held out: blocks, folds, halves and thirds
student   eight standard laws, the best by AICc; a Gaussian process
answers   what the loop says of records and of parts of them
errors    errors on samples that nothing saw
table     the table; figure the figure; `python -m tests.records` prints and draws both
"""
