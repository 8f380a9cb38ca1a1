//! The process's parts are exact inverse partners, and follow `lie`.

use dose3_diffusion::{
    Estimate, Noise, NoiseSchedule, Process, ProcessConfig, RotationNoise, RotationProcess, State,
    Window, rotation_logs, rotation_tangents,
};
use dose3_lie::{Rotation, Vector, so3};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

#[path = "../../ood/src/property_cases.rs"]
mod property_cases;

use property_cases::cases;

const LENGTH: usize = 16;

fn rotation_slice(rotations: &[Rotation]) -> Vec<f32> {
    rotations
        .iter()
        .flat_map(|r| {
            let m = *r.matrix();
            (0..9).map(move |i| m[(i / 3, i % 3)] as f32)
        })
        .collect()
}

fn random_window(seed: u64) -> (Vec<f32>, Vec<Rotation>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let n = Noise::draw(&mut rng, LENGTH, RotationNoise::Tangent);
    let rotations = n
        .rotation
        .chunks_exact(3)
        .map(|v| so3::exp(&(Vector::new(v[0].into(), v[1].into(), v[2].into()) * 1.5)))
        .collect();
    (n.translation, rotations)
}

fn process(rotation_process: RotationProcess, rotation: NoiseSchedule) -> Process {
    Process::new(ProcessConfig {
        rotation_process,
        rotation,
        ..ProcessConfig::default()
    })
    .unwrap()
}

fn rotations(state: &State) -> Vec<Rotation> {
    rotation_logs(&state.rotation)
        .iter()
        .map(so3::exp)
        .collect()
}

proptest! {
    #![proptest_config(cases(32))]

    /// Group product: the true noise gives back every clean window at every step, up to f32
    /// rounding magnified by `1 / sqrt(alpha_bar)`.
    #[test]
    fn x0_hat_undoes_forward(seed in any::<u64>(), t in 0usize..30) {
        let p = process(RotationProcess::Group, NoiseSchedule::COSINE);
        let (translation, clean) = random_window(seed);
        let rotation = rotation_slice(&clean);
        let window = Window { translation: &translation, rotation: &rotation };
        let noise = Noise::draw(&mut ChaCha8Rng::seed_from_u64(!seed), LENGTH, RotationNoise::Tangent);
        let noised = p.forward(window, &noise, t).unwrap();
        let truth = Estimate { translation: &noise.translation, rotation: &noise.rotation };
        let back = p.x0_hat(noised.as_window(), truth, t).unwrap();
        let tolerance = 3e-6 / p.translation.signal(t);
        for (a, b) in back.translation.iter().zip(&translation) {
            prop_assert!(f64::from((a - b).abs()) < tolerance, "translation {} vs {}", a, b);
        }
        for (a, b) in rotations(&back).iter().zip(&clean) {
            prop_assert!(so3::distance(a, b) < tolerance + 1e-5, "step {} distance {}", t, so3::distance(a, b));
        }
    }

    /// Tangent sum: the same wherever the sum stays inside the ball of radius pi.
    #[test]
    fn x0_hat_undoes_the_tangent_sum_inside_the_ball(seed in any::<u64>(), t in 0usize..30) {
        let p = process(RotationProcess::Tangent, NoiseSchedule::LINEAR);
        let (_, clean) = random_window(seed);
        let noise = Noise::draw(&mut ChaCha8Rng::seed_from_u64(!seed), LENGTH, RotationNoise::Tangent);
        for (i, r) in clean.iter().enumerate() {
            let z = Vector::new(
                noise.rotation[i * 3].into(),
                noise.rotation[i * 3 + 1].into(),
                noise.rotation[i * 3 + 2].into(),
            );
            let log = so3::log(r);
            let sum = log * p.rotation.signal(t) + z * p.rotation.noise(t);
            let back = p.x0_rotation(&p.noise_rotation(&log, &z, t), &z, t);
            if sum.norm() < std::f64::consts::PI {
                prop_assert!(so3::distance(&back, r) < 1e-9);
            }
        }
    }

    /// The batched f32 forms agree with `lie` pose by pose.
    #[test]
    fn batched_log_and_forward_agree_with_lie(seed in any::<u64>(), t in 0usize..30) {
        let p = process(RotationProcess::Group, NoiseSchedule::COSINE);
        let (translation, clean) = random_window(seed);
        let rotation = rotation_slice(&clean);
        for (log, r) in rotation_tangents(&rotation).chunks_exact(3).zip(&clean) {
            let log = Vector::new(log[0].into(), log[1].into(), log[2].into());
            prop_assert!(so3::distance(&so3::exp(&log), r) < 2e-6);
        }
        let noise = Noise::draw(&mut ChaCha8Rng::seed_from_u64(!seed), LENGTH, RotationNoise::IgSo3);
        let window = Window { translation: &translation, rotation: &rotation };
        let noised = p.forward(window, &noise, t).unwrap();
        for (i, (a, r)) in rotations(&noised).iter().zip(&clean).enumerate() {
            let z = &noise.rotation[i * 3..i * 3 + 3];
            let z = Vector::new(z[0].into(), z[1].into(), z[2].into());
            let expected = so3::compose(
                &so3::scale(p.rotation.signal(t), r),
                &so3::scale(p.rotation.noise(t), &so3::exp(&z)),
            );
            // The noise of IG_SO(3) lies inside the ball, so scaling it as a rotation is scaling
            // its tangent vector.
            prop_assert!(so3::distance(a, &expected) < 1e-5, "{}", so3::distance(a, &expected));
        }
    }
}

/// The posterior mean by hand, and the same for rotations about one axis, which commute.
#[test]
fn posterior_mean_by_hand() {
    for mode in [RotationProcess::Group, RotationProcess::Tangent] {
        let p = process(mode, NoiseSchedule::COSINE);
        for t in [3, 11, 25] {
            // beta, alpha_bar from the definition, not from the table under test.
            let f = |k: usize| {
                ((k as f64 / 30.0 + 0.008) / 1.008 * std::f64::consts::FRAC_PI_2)
                    .cos()
                    .powi(2)
            };
            let (now, before) = (f(t + 1) / f(0), f(t) / f(0));
            let beta = 1.0 - now / before;
            let w0 = before.sqrt() * beta / (1.0 - now);
            let wt = (1.0 - beta).sqrt() * (1.0 - before) / (1.0 - now);
            let axis = Vector::new(0.0, 0.6, 0.8);
            let clean = rotation_slice(&[so3::exp(&(axis * 0.9))]);
            let noised = rotation_slice(&[so3::exp(&(axis * -1.7))]);
            let x0 = Window {
                translation: &[0.3, -0.2, 1.0],
                rotation: &clean,
            };
            let x_t = Window {
                translation: &[-1.1, 0.4, 2.0],
                rotation: &noised,
            };
            let mean = p.posterior_mean(x0, x_t, t).unwrap();
            for ((m, a), b) in mean
                .translation
                .iter()
                .zip(x0.translation)
                .zip(x_t.translation)
            {
                let expected = w0 * f64::from(*a) + wt * f64::from(*b);
                assert!((f64::from(*m) - expected).abs() < 1e-6, "{mode:?} {t}");
            }
            let log = rotation_logs(&mean.rotation)[0];
            assert!(
                (log - axis * (w0 * 0.9 - wt * 1.7)).norm() < 1e-6,
                "{mode:?} {t}"
            );
        }
    }
}

/// A network that knows the clean window answers the noise that leads to it; ancestral steps with
/// that answer walk the noised window back, each one closer to the clean window's own marginal.
#[test]
fn sampling_with_a_perfect_estimate_ends_at_the_clean_window() {
    let p = process(RotationProcess::Group, NoiseSchedule::COSINE);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let (translation, clean) = random_window(11);
    let mut state = p.prior(&Noise::draw(&mut rng, LENGTH, RotationNoise::Tangent));
    for t in (0..p.steps()).rev() {
        let (a, s) = (p.translation.signal(t), p.translation.noise(t));
        let eps: Vec<f32> = state
            .translation
            .iter()
            .zip(&translation)
            .map(|(x, x0)| ((f64::from(*x) - a * f64::from(*x0)) / s) as f32)
            .collect();
        let rotation: Vec<f32> = rotations(&state)
            .iter()
            .zip(&clean)
            .flat_map(|(x, x0)| {
                let target = so3::scale(p.rotation.signal(t), x0);
                let e = so3::log(&(x.inverse() * target)) / -p.rotation.noise(t);
                [e.x as f32, e.y as f32, e.z as f32]
            })
            .collect();
        let estimate = Estimate {
            translation: &eps,
            rotation: &rotation,
        };
        let fresh = Noise::draw(&mut rng, LENGTH, RotationNoise::Tangent);
        state = p
            .sample_step(state.as_window(), estimate, &fresh, t)
            .unwrap();
        if t == 10 {
            // Half way the state still is noise: a sampler that jumped to x0 would not be.
            let far = state
                .translation
                .iter()
                .zip(&translation)
                .map(|(x, y)| (x - y).abs());
            assert!(far.sum::<f32>() / translation.len() as f32 > 0.1);
        }
    }
    for (a, b) in state.translation.iter().zip(&translation) {
        assert!((a - b).abs() < 1e-4, "{a} {b}");
    }
    for (a, b) in rotations(&state).iter().zip(&clean) {
        assert!(so3::distance(a, b) < 1e-3, "{}", so3::distance(a, b));
    }
}

/// The noised window's moments: mean `sqrt(abar) x0`, variance `1 - abar`.
#[test]
fn forward_has_the_moments_of_its_equation() {
    let p = process(RotationProcess::Group, NoiseSchedule::COSINE);
    let length = 20_000;
    let identity = rotation_slice(&[Rotation::identity()]).repeat(length);
    let window = Window {
        translation: &vec![0.7; length * 3],
        rotation: &identity,
    };
    let noise = Noise::draw(
        &mut ChaCha8Rng::seed_from_u64(5),
        length,
        RotationNoise::Tangent,
    );
    for t in [2, 14, 29] {
        let noised = p.forward(window, &noise, t).unwrap();
        let n = (length * 3) as f64;
        let mean = noised
            .translation
            .iter()
            .map(|x| f64::from(*x))
            .sum::<f64>()
            / n;
        let variance = noised
            .translation
            .iter()
            .map(|x| (f64::from(*x) - mean).powi(2))
            .sum::<f64>()
            / n;
        let abar = (((t + 1) as f64 / 30.0 + 0.008) / 1.008 * std::f64::consts::FRAC_PI_2)
            .cos()
            .powi(2)
            / (0.008_f64 / 1.008 * std::f64::consts::FRAC_PI_2)
                .cos()
                .powi(2);
        assert!(
            (mean - abar.max(0.0).sqrt() * 0.7).abs() < 0.02,
            "{t}: {mean}"
        );
        assert!((variance - (1.0 - abar)).abs() < 0.02, "{t}: {variance}");
        // Tangent Gaussian: E |v|^2 = 3 sigma^2 while the norm stays well inside the ball.
        if t == 2 {
            let squares = rotation_logs(&noised.rotation)
                .iter()
                .map(Vector::norm_squared)
                .sum::<f64>();
            let expected = 3.0 * p.rotation.noise(t).powi(2);
            assert!((squares / length as f64 / expected - 1.0).abs() < 0.03);
        }
    }
}

#[test]
fn wrong_sizes_are_refused_with_their_numbers() {
    let p = process(RotationProcess::Group, NoiseSchedule::COSINE);
    let noise = Noise::draw(&mut ChaCha8Rng::seed_from_u64(0), 4, RotationNoise::Tangent);
    let window = Window {
        translation: &[0.0; 12],
        rotation: &[0.0; 27],
    };
    let error = p.forward(window, &noise, 0).unwrap_err().to_string();
    assert!(error.contains("expected 36 numbers, found 27"), "{error}");
}
