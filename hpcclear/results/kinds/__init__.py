"""Kinds of result files, a file each: what stands in it (`hpcclear.results.names.KINDS` finds them)."""
