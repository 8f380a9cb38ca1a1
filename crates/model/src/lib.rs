//! The 1-D UNet noise estimator of DOSE3: configuration, parameter layout, safetensors, and its burn implementation.
