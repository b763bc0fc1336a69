"""Time histories as signals, whatever they measure: filtering, resampling, spectra, noise and regression."""
