//! The process's parts are exact inverse partners, and follow `lie`.

use dose3_diffusion::{
    Estimate, Noise, NoiseSchedule, Process, ProcessConfig, RotationNoise, RotationProcess, State,
    Window, rotation_logs, rotation_tangents,
};
use dose3_lie::{Rotation, Vector, so3};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

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
    #![proptest_config(ProptestConfig::with_cases(32))]

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

/// With the truth in the network's place, ancestral sampling walks back to the clean window.
#[test]
fn sampling_with_the_true_noise_ends_at_the_clean_window() {
    for mode in [RotationProcess::Group, RotationProcess::Tangent] {
        let p = process(mode, NoiseSchedule::COSINE);
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let (translation, _) = random_window(11);
        let clean: Vec<Rotation> = (0..LENGTH)
            .map(|i| so3::exp(&Vector::new(0.05 * i as f64, -0.3, 0.1)))
            .collect();
        let rotation = rotation_slice(&clean);
        let x0 = Window {
            translation: &translation,
            rotation: &rotation,
        };
        let mut state = p.prior(&Noise::draw(&mut rng, LENGTH, RotationNoise::Tangent));
        for t in (0..p.steps()).rev() {
            let fresh = Noise::draw(&mut rng, LENGTH, RotationNoise::Tangent);
            state = p.step_from_x0(x0, state.as_window(), &fresh, t).unwrap();
        }
        for (a, b) in state.translation.iter().zip(&translation) {
            assert!((a - b).abs() < 1e-5);
        }
        for (a, b) in rotations(&state).iter().zip(&clean) {
            assert!(so3::distance(a, b) < 1e-5, "{mode:?}");
        }
    }
}

/// Forward by one schedule step at a time, or in one jump: the same variance (translation).
#[test]
fn stepwise_and_direct_forward_have_the_same_moments() {
    let p = process(RotationProcess::Group, NoiseSchedule::COSINE);
    for t in [0, 10, 29] {
        let variance = (0..=t).fold(0.0, |v, k| {
            (1.0 - p.translation.beta(k)) * v + p.translation.beta(k)
        });
        assert!((variance - p.translation.noise(t).powi(2)).abs() < 1e-12);
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
