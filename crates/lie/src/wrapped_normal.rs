//! The tangent Gaussian wrapped onto SO(3): what the DOSE3 paper samples.

use std::f64::consts::{PI, TAU};

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::igso3::{SigmaError, checked_sigma};
use crate::{Rotation, Vector, so3};

/// The law of `exp(v)` with `v ~ N(0, sigma^2 I)`, sigma in radians.
///
/// The DOSE3 paper (equation "igso3", read as `mu (+) exp(v)`) calls this IG_SO(3). It agrees with
/// [`IgSo3`](crate::IgSo3) for small sigma only: it is not closed under composition, and as sigma grows its
/// angle becomes uniform on `[0, pi]`, not its rotation uniform on the group.
///
/// ```
/// use dose3_lie::{Rotation, WrappedNormal};
/// use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
///
/// let noise = WrappedNormal::new(1.0)?;
/// let rotation = noise.sample(&mut ChaCha8Rng::seed_from_u64(7), &Rotation::identity());
/// assert!(rotation.matrix().determinant() > 0.999);
/// # Ok::<(), dose3_lie::SigmaError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrappedNormal {
    sigma: f64,
}

impl WrappedNormal {
    /// The distribution with this sigma in radians.
    ///
    /// # Errors
    /// [`SigmaError`] if `sigma` is not finite or below [`SMALLEST_SIGMA`](crate::igso3::SMALLEST_SIGMA).
    pub fn new(sigma: f64) -> Result<Self, SigmaError> {
        Ok(Self {
            sigma: checked_sigma(sigma)?,
        })
    }

    /// Sigma in radians.
    pub fn sigma(&self) -> f64 {
        self.sigma
    }

    /// Density of the angle of `exp(v)`, per radian; integrates to 1 over `[0, pi]`, 0 outside.
    ///
    /// The norm of `v` is Maxwell distributed; norms `2 pi k + w` and `2 pi k - w` all turn by `w`.
    pub fn density(&self, angle: f64) -> f64 {
        if !(0.0..=PI).contains(&angle) {
            return 0.0;
        }
        // By Poisson summation the next term is of order sigma^2 exp(-sigma^2 / 2), here below 1e-19.
        if self.sigma > 10.0 {
            return 1.0 / PI;
        }
        let windings = (10.0 * self.sigma / TAU).ceil() as u32;
        let wrapped = (1..=windings).map(|k| TAU * f64::from(k));
        let folded =
            wrapped.map(|turn| self.norm_density(turn - angle) + self.norm_density(turn + angle));
        self.norm_density(angle) + folded.sum::<f64>()
    }

    /// Maxwell density of the norm of `v`.
    fn norm_density(&self, norm: f64) -> f64 {
        let x = norm / self.sigma;
        (2.0 / PI).sqrt() * x * x * (-0.5 * x * x).exp() / self.sigma
    }

    /// The tangent vector `v`, unwrapped: its norm may exceed pi.
    pub fn sample_tangent<R: Rng + ?Sized>(&self, rng: &mut R) -> Vector {
        Vector::from_fn(|_, _| {
            let normal: f64 = StandardNormal.sample(rng);
            self.sigma * normal
        })
    }

    /// The rotation `mean (+) exp(v)`.
    pub fn sample<R: Rng + ?Sized>(&self, rng: &mut R, mean: &Rotation) -> Rotation {
        so3::compose(mean, &so3::exp(&self.sample_tangent(rng)))
    }
}
