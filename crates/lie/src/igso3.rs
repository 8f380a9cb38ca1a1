//! IG_SO(3), the isotropic Gaussian on SO(3).
//!
//! It is the law at time `sigma^2` of a Brownian motion on SO(3), and so closed under composition: the
//! product of independent samples with `sigma_1` and `sigma_2` has `sigma^2 = sigma_1^2 + sigma_2^2`.
//!
//! **Meaning of sigma** (radians): for small sigma the tangent vector is `N(0, sigma^2 I)`, so the heat
//! kernel carries `exp(-l (l + 1) sigma^2 / 2)`. Papers that write `exp(-l (l + 1) epsilon^2)` have
//! `epsilon = sigma / sqrt(2)`.
//!
//! The DOSE3 paper samples `exp(v)`, `v ~ N(0, sigma^2 I)`, under this name; that is
//! [`WrappedNormal`](crate::WrappedNormal), the same to first order in `sigma^2` only.

use std::f64::consts::PI;

use rand::{Rng, RngExt};
use rand_distr::{Distribution, UnitSphere};

use crate::angle_table::AngleTable;
use crate::heat_kernel::{heat_kernel, uniform_angle_density};
use crate::{Rotation, Vector, so3};

/// Smallest accepted sigma in radians: matrix entries are rounded at 1e-16, so less would be mostly rounding.
pub const SMALLEST_SIGMA: f64 = 1e-12;

/// A sigma that is not a finite number of at least [`SMALLEST_SIGMA`] radians.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("sigma is {sigma}, but must be finite and at least {SMALLEST_SIGMA:e} radians")]
pub struct SigmaError {
    /// The refused value.
    pub sigma: f64,
}

/// Passes on an acceptable sigma.
pub(crate) fn checked_sigma(sigma: f64) -> Result<f64, SigmaError> {
    if sigma.is_finite() && sigma >= SMALLEST_SIGMA {
        Ok(sigma)
    } else {
        Err(SigmaError { sigma })
    }
}

/// The isotropic Gaussian on SO(3) of one sigma, with the table for sampling its angle.
///
/// Building one costs a few thousand evaluations of the density (about a millisecond); keep it for
/// repeated sampling.
///
/// ```
/// use dose3_lie::{IgSo3, Rotation, so3};
/// use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
///
/// let noise = IgSo3::new(0.1)?;
/// let mut rng = ChaCha8Rng::seed_from_u64(7);
/// let sample = noise.sample(&mut rng, &Rotation::identity());
/// assert!(so3::distance(&sample, &Rotation::identity()) < 0.5);
/// assert!(noise.cdf(0.5) > 0.999);
/// # Ok::<(), dose3_lie::SigmaError>(())
/// ```
#[derive(Clone, Debug)]
pub struct IgSo3 {
    sigma: f64,
    table: AngleTable,
}

impl IgSo3 {
    /// The distribution with this sigma in radians.
    ///
    /// # Errors
    /// [`SigmaError`] if `sigma` is not finite or below [`SMALLEST_SIGMA`]. There is no upper bound: from
    /// about 6 on it is the uniform distribution to rounding.
    pub fn new(sigma: f64) -> Result<Self, SigmaError> {
        let sigma = checked_sigma(sigma)?;
        // Less than 1e-20 of the mass lies beyond ten sigma.
        let upper = PI.min(10.0 * sigma);
        let table = AngleTable::new(upper, |angle| angle_density(angle, sigma));
        Ok(Self { sigma, table })
    }

    /// Sigma in radians.
    pub fn sigma(&self) -> f64 {
        self.sigma
    }

    /// Density of the angle from the mean, per radian; integrates to 1 over `[0, pi]`, 0 outside.
    ///
    /// It includes the factor `(1 - cos w) / pi`, the share of rotations that have angle `w`.
    pub fn density(&self, angle: f64) -> f64 {
        if (0.0..=PI).contains(&angle) {
            angle_density(angle, self.sigma)
        } else {
            0.0
        }
    }

    /// Density with respect to the uniform (Haar) probability measure, at a rotation by `angle` in
    /// `[0, pi]` from the mean; 1 everywhere for the uniform distribution.
    pub fn density_on_group(&self, angle: f64) -> f64 {
        heat_kernel(angle, self.sigma)
    }

    /// Probability of an angle of at most `angle` radians, from a table that is accurate to 1e-10.
    pub fn cdf(&self, angle: f64) -> f64 {
        self.table.cdf(angle)
    }

    /// Angle in radians that is exceeded with probability `1 - probability`: the inverse of [`Self::cdf`].
    ///
    /// A probability outside `[0, 1]` counts as the nearer end.
    pub fn quantile(&self, probability: f64) -> f64 {
        self.table.quantile(probability.clamp(0.0, 1.0))
    }

    /// An angle in `[0, pi]` radians, from one uniform number through [`Self::quantile`].
    pub fn sample_angle<R: Rng + ?Sized>(&self, rng: &mut R) -> f64 {
        self.quantile(rng.random::<f64>())
    }

    /// A tangent vector whose [`so3::exp`] is distributed around the identity: a uniform axis times
    /// [`Self::sample_angle`].
    pub fn sample_tangent<R: Rng + ?Sized>(&self, rng: &mut R) -> Vector {
        let angle = self.sample_angle(rng);
        let axis: [f64; 3] = UnitSphere.sample(rng);
        Vector::from(axis) * angle
    }

    /// A rotation distributed around `mean`. Multiplying from the left instead would have the same law.
    pub fn sample<R: Rng + ?Sized>(&self, rng: &mut R, mean: &Rotation) -> Rotation {
        so3::compose(mean, &so3::exp(&self.sample_tangent(rng)))
    }
}

/// Density of the angle on `[0, pi]`.
fn angle_density(angle: f64, sigma: f64) -> f64 {
    heat_kernel(angle, sigma) * uniform_angle_density(angle)
}
