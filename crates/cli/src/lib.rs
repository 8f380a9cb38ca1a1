//! Is this pose log like the logs I trust? Diffusion-based out-of-distribution detection on SE(3) trajectories.
