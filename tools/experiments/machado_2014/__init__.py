"""Machado e Silva 2014: which points an eye sees, by this operator and others, beside the truth."""
