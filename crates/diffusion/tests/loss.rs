//! The losses' closed-form gradients against numeric differences, and their behaviour at the
//! points where the paper's arccos has none.

use dose3_diffusion::{LossConfig, Process, ProcessConfig, RotationProcess, geodesic_loss};
use dose3_lie::{Rotation, Vector, so3};
use proptest::prelude::*;
use std::f64::consts::PI;

#[path = "../../ood/src/property_cases.rs"]
mod property_cases;

use property_cases::cases;

/// Estimate in, gradient to fill.
type BranchLoss<'a> = dyn Fn(&[f32], &mut [f32]) -> dose3_diffusion::SampleLoss + 'a;

fn vector(range: f64) -> impl Strategy<Value = Vector> {
    [-range..range, -range..range, -range..range].prop_map(|[x, y, z]| Vector::new(x, y, z))
}

fn numeric(f: impl Fn(&Vector) -> f64, at: &Vector) -> Vector {
    let h = 1e-6;
    Vector::from_fn(|i, _| {
        let mut d = Vector::zeros();
        d[i] = h;
        (f(&(at + d)) - f(&(at - d))) / (2.0 * h)
    })
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn geodesic_gradient_is_the_numeric_one(a in vector(4.0), b in vector(4.0)) {
        let (value, gradient) = geodesic_loss(&a, &b);
        // The distance has a kink where the rotations are pi apart.
        prop_assume!(value.sqrt() < PI - 1e-3);
        let expected = numeric(|a| geodesic_loss(a, &b).0, &a);
        prop_assert!((gradient - expected).norm() < 1e-4 * (1.0 + expected.norm()), "{} {}", gradient, expected);
        let distance = so3::distance(&so3::exp(&a), &so3::exp(&b));
        prop_assert!((value - distance * distance).abs() < 1e-9);
    }

    #[test]
    fn x0_gradient_is_the_numeric_one(
        eps in vector(1.5), x in vector(1.5), clean in vector(1.5), t in 0usize..28,
        tangent in any::<bool>(),
    ) {
        let rotation_process =
            if tangent { RotationProcess::Tangent } else { RotationProcess::Group };
        let p = Process::new(ProcessConfig { rotation_process, ..ProcessConfig::default() }).unwrap();
        let (x_t, clean) = (so3::exp(&x), so3::exp(&clean));
        let loss = |e: &Vector| p.x0_rotation_loss(e, &x_t, &clean, t);
        let (value, gradient) = loss(&eps);
        // Away from the kinks of the distance and of the inner logarithm.
        let inner = so3::log(&(x_t * so3::exp(&(eps * -p.rotation.noise(t))))).norm();
        prop_assume!(value.sqrt() < PI - 0.1 && inner < PI - 0.1);
        let expected = numeric(|e| loss(e).0, &eps);
        prop_assert!((gradient - expected).norm() < 1e-3 * (1.0 + expected.norm()), "{} {}", gradient, expected);
    }
}

#[test]
fn gradients_are_finite_where_the_arccos_has_none() {
    let p = Process::new(ProcessConfig::default()).unwrap();
    for axis in [Vector::x(), Vector::y(), Vector::z()] {
        for angle in [0.0, 1e-12, 1e-8, PI - 1e-8, PI, 2.0 * PI, 7.0] {
            let a = axis * angle;
            for b in [Vector::zeros(), a, a * 0.5, -a] {
                let (value, gradient) = geodesic_loss(&a, &b);
                assert!(value.is_finite() && gradient.norm().is_finite(), "{a} {b}");
                for t in 0..30 {
                    let (value, gradient) =
                        p.x0_rotation_loss(&a, &so3::exp(&b), &Rotation::identity(), t);
                    assert!(
                        value.is_finite() && gradient.norm().is_finite(),
                        "{a} {b} {t}"
                    );
                }
            }
        }
    }
    let (value, gradient) = geodesic_loss(&Vector::x(), &Vector::x());
    assert_eq!((value, gradient.norm()), (0.0, 0.0));
}

/// Whole-sample losses: gradient against numeric differences of the total.
#[test]
fn sample_gradients_are_the_numeric_ones() {
    let p = Process::new(ProcessConfig::default()).unwrap();
    let config = LossConfig {
        eps_weight: 0.7,
        x0_weight: 1.3,
        x0_ceiling: 2.0,
    };
    let eps_hat: Vec<f32> = (0..6).map(|i| 0.3 * (i as f32) - 0.7).collect();
    let eps: Vec<f32> = (0..6).map(|i| 0.9 - 0.25 * (i as f32)).collect();
    let matrix = |v: Vector| {
        let m = *so3::exp(&v).matrix();
        (0..9).map(move |i| m[(i / 3, i % 3)] as f32)
    };
    let x_t: Vec<f32> = matrix(Vector::new(0.2, 0.1, -0.4))
        .chain(matrix(Vector::y()))
        .collect();
    let clean: Vec<f32> = matrix(Vector::z())
        .chain(matrix(Vector::x() * 0.3))
        .collect();
    for t in [0, 7, 20, 29] {
        let translation = |e: &[f32], g: &mut [f32]| p.translation_loss(&config, t, e, &eps, g);
        let rotation =
            |e: &[f32], g: &mut [f32]| p.rotation_loss(&config, t, e, &eps, &x_t, &clean, g);
        let losses: [&BranchLoss<'_>; 2] = [&translation, &rotation];
        for loss in losses {
            let mut gradient = vec![0.0; 6];
            loss(&eps_hat, &mut gradient);
            for i in 0..6 {
                let at = |d: f32| {
                    let mut e = eps_hat.clone();
                    e[i] += d;
                    loss(&e, &mut [0.0; 6]).total
                };
                let h = 1e-3;
                let numeric = (at(h) - at(-h)) / (2.0 * f64::from(h));
                assert!(
                    (numeric - f64::from(gradient[i])).abs() < 2e-2 * (1.0 + numeric.abs()),
                    "step {t}, {i}: {numeric} {}",
                    gradient[i]
                );
            }
        }
    }
}
