"""What every room stands on: errors, outcome codes, how code is compiled."""
