"""The closed loop: what the model misses, which effect would explain it, and what cannot be separated."""
