"""Statistics on arrays: surrogates, sensitivity, random inputs, search, sums of samples."""
