//! Out-of-distribution statistics, densities, calibration and metrics.
