//! SO(3), SE(3) and the isotropic Gaussian on SO(3), in f64 on nalgebra.
