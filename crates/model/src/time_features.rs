/// Sinusoidal features of a diffusion step: `[sin(step * f_j), cos(step * f_j)]` with
/// `f_j = exp(-ln(10000) * j / (width / 2 - 1))`, `j = 0 .. width / 2`.
///
/// Computed in f64 and rounded once, so that every implementation of the network sees
/// the same numbers. `width` is the network's, even and at least 4.
///
/// ```
/// let features = dose3_model::sinusoidal(0.0, 8);
/// assert_eq!(features, [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]);
/// ```
pub fn sinusoidal(step: f32, width: usize) -> Vec<f32> {
    let mut features = vec![0.0; width];
    sinusoidal_into(step, &mut features);
    features
}

/// [`sinusoidal`] into a slice of the network's width.
pub fn sinusoidal_into(step: f32, features: &mut [f32]) {
    let half = features.len() / 2;
    let (sines, cosines) = features.split_at_mut(half);
    for (j, (sine, cosine)) in sines.iter_mut().zip(cosines).enumerate() {
        let frequency = (-10_000f64.ln() * j as f64 / (half as f64 - 1.0)).exp();
        let angle = f64::from(step) * frequency;
        *sine = angle.sin() as f32;
        *cosine = angle.cos() as f32;
    }
}
