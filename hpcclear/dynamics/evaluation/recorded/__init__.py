"""One sample with its accepted steps kept: its motion between them, impacts, spectra of its forces."""
