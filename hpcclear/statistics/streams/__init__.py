"""Summaries of samples that merge in any order to the same bits."""
