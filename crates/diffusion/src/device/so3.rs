//! SO(3) on a device: every number of a rotation or a tangent vector is a tensor `[batch, length]`, one entry a pose.
//!
//! The formulas of [`dose3_lie::so3`] in f32. Ratios that are 0/0 at an angle of 0 are Taylor polynomials near it;
//! all go through the unit quaternion, so that nothing is singular at pi either.

use burn::tensor::Tensor;

/// A vector for each pose.
#[derive(Clone)]
pub(super) struct Vectors([Tensor<2>; 3]);

impl Vectors {
    /// From `[batch, length, 3]`.
    pub(super) fn of(x: &Tensor<3>) -> Self {
        Self([0, 1, 2].map(|i| x.clone().narrow(2, i, 1).squeeze_dim::<2>(2)))
    }

    /// To `[batch, length, 3]`.
    pub(super) fn stack(self) -> Tensor<3> {
        Tensor::stack(self.0.to_vec(), 2)
    }

    pub(super) fn square(&self) -> Tensor<2> {
        let [x, y, z] = self.0.clone().map(|x| x.square());
        x + y + z
    }

    /// `factor` is `[batch, length]` or `[batch, 1]`.
    pub(super) fn times(&self, factor: &Tensor<2>) -> Self {
        Self(self.0.clone().map(|x| x * factor.clone()))
    }

    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self(self.0.clone().map(|x| x * factor))
    }

    pub(super) fn plus(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Self([a + x, b + y, c + z])
    }

    fn cross(&self, other: &Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0.clone(), other.0.clone());
        Self([
            b.clone() * z.clone() - c.clone() * y.clone(),
            c * x.clone() - a.clone() * z,
            a * y - b * x,
        ])
    }

    /// `u + first (v x u) + second (v x (v x u))` with `v` this vector: all Jacobians of SO(3) have this form.
    fn jacobian(&self, first: &Tensor<2>, second: &Tensor<2>, u: &Self) -> Self {
        let once = self.cross(u);
        let twice = self.cross(&once);
        u.clone().plus(once.times(first)).plus(twice.times(second))
    }
}

/// `c0 + c1 x + c2 x^2 + ...`
fn polynomial(x: &Tensor<2>, coefficients: &[f64]) -> Tensor<2> {
    let (last, others) = coefficients.split_last().expect("a coefficient");
    let start = x.zeros_like() + *last;
    let horner = |sum: Tensor<2>, c: &f64| sum * x.clone() + *c;
    others.iter().rev().fold(start, horner)
}

/// Unit quaternions, one a pose.
pub(super) struct Quaternions {
    pub(super) real: Tensor<2>,
    pub(super) imaginary: Vectors,
}

impl Quaternions {
    /// From `[batch, length, 4]`, real part first.
    pub(super) fn of(x: &Tensor<3>) -> Self {
        Self {
            real: x.clone().narrow(2, 0, 1).squeeze_dim::<2>(2),
            imaginary: Vectors::of(&x.clone().narrow(2, 1, 3)),
        }
    }

    pub(super) fn inverse(&self) -> Self {
        Self {
            real: self.real.clone(),
            imaginary: Vectors(self.imaginary.0.clone().map(|x| x.neg())),
        }
    }

    /// The group product: first `other`, then this.
    pub(super) fn times(&self, other: &Self) -> Self {
        let dot = self.imaginary.0.iter().zip(&other.imaginary.0);
        let real = dot.fold(self.real.clone() * other.real.clone(), |sum, (x, y)| {
            sum - x.clone() * y.clone()
        });
        let imaginary = other.imaginary.times(&self.real);
        let imaginary = imaginary.plus(self.imaginary.times(&other.real));
        Self {
            real,
            imaginary: imaginary.plus(self.imaginary.cross(&other.imaginary)),
        }
    }
}

/// A tangent vector with what its exponential and right Jacobian share.
pub(super) struct Tangent {
    vector: Vectors,
    /// Squared angle.
    square: Tensor<2>,
    /// `sin(angle / 2) / angle`
    ratio: Tensor<2>,
    /// `cos(angle / 2)`
    cosine: Tensor<2>,
}

impl Tangent {
    pub(super) fn new(vector: Vectors) -> Self {
        let square = vector.square();
        let near = square.clone().lower_elem(1.0);
        let angle = square.clone().clamp_min(1.0).sqrt();
        let far = (angle.clone() * 0.5).sin() / angle;
        let series = [0.5, -1.0 / 48.0, 1.0 / 3840.0, -1.0 / 645_120.0];
        let ratio = far.mask_where(near, polynomial(&square, &series));
        let cosine = (square.clone().sqrt() * 0.5).cos();
        Self {
            vector,
            square,
            ratio,
            cosine,
        }
    }

    pub(super) fn exp(&self) -> Quaternions {
        Quaternions {
            real: self.cosine.clone(),
            imaginary: self.vector.times(&self.ratio),
        }
    }

    /// The transposed right Jacobian times `u`: takes a gradient at `exp` to one at the vector.
    pub(super) fn pull_back(&self, u: &Vectors) -> Vectors {
        // (1 - cos) / angle^2, and (angle - sin) / angle^3 with sin = 2 sin(angle / 2) cos(angle / 2).
        let first = self.ratio.clone().square() * 2.0;
        let sine = self.ratio.clone() * self.cosine.clone() * 2.0;
        let far = (sine.neg() + 1.0) / self.square.clone().clamp_min(1.0);
        let series = [1.0 / 6.0, -1.0 / 120.0, 1.0 / 5040.0, -1.0 / 362_880.0];
        let near = self.square.clone().lower_elem(1.0);
        let second = far.mask_where(near, polynomial(&self.square, &series));
        self.vector.jacobian(&first, &second, u)
    }
}

/// The logarithm of a quaternion with what its inverse right Jacobian needs.
pub(super) struct Logarithm {
    /// The shortest rotation vector.
    pub(super) vector: Vectors,
    /// `angle / 2 * cot(angle / 2)`
    cotangent: Tensor<2>,
}

impl Logarithm {
    pub(super) fn of(q: &Quaternions) -> Self {
        // Of q and -q the one with a real part of at least 0: its angle is at most pi.
        let sign = q.real.clone().lower_elem(0.0).float() * -2.0 + 1.0;
        let (real, imaginary) = (q.real.clone() * sign.clone(), q.imaginary.times(&sign));
        let square = imaginary.square(); // sin(angle / 2)^2
        let near = square.clone().lower_elem(1.0 / 64.0);
        let sine = square.clone().clamp_min(1.0 / 64.0).sqrt();
        let far = (sine.clone() / (real.clone() + 1.0)).atan() * 4.0 / sine;
        // 2 asin(x) / x
        let series = [2.0, 1.0 / 3.0, 3.0 / 20.0, 5.0 / 56.0];
        let ratio = far.mask_where(near, polynomial(&square, &series)); // angle / sin(angle / 2)
        Self {
            vector: imaginary.times(&ratio),
            cotangent: ratio * real * 0.5,
        }
    }

    /// The transposed inverse right Jacobian times `u`: takes a gradient at the vector to one at the rotation.
    pub(super) fn pull_back(&self, u: &Vectors) -> Vectors {
        let square = self.vector.square();
        let far = (self.cotangent.clone().neg() + 1.0) / square.clone().clamp_min(1.0);
        let series = [1.0 / 12.0, 1.0 / 720.0, 1.0 / 30_240.0, 1.0 / 1_209_600.0];
        let near = square.clone().lower_elem(1.0);
        let second = far.mask_where(near, polynomial(&square, &series));
        let first = square.zeros_like() - 0.5;
        self.vector.jacobian(&first, &second, u)
    }
}

/// Squared geodesic distance between `exp(a)` and `target`, and its gradient with respect to `a`
/// ([`geodesic_loss`](crate::geodesic_loss)).
pub(super) fn geodesic(a: &Tangent, target: &Quaternions) -> (Tensor<2>, Vectors) {
    let phi = Logarithm::of(&a.exp().inverse().times(target)).vector;
    let gradient = a.pull_back(&phi).scaled(-2.0);
    (phi.square(), gradient)
}
