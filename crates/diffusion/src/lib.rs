//! Diffusion over SE(3) pose sequences: schedules, forward process, sampling, losses, trainer.
