"""Foundation of every package: errors, outcome codes, compilation."""
