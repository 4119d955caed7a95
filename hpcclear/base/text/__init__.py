"""Writes functions out as one text: values that are known, expressions, statements, and functions that are alike."""
