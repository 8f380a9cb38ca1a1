//! Gradients against differences of the loss.

use dose3_model::{NoiseModel, UNetConfig};

mod support;

use support::{Batch, engine, parameters};

/// `sum(output * upstream)` in f64.
fn loss(batch: &Batch, model: &mut dyn NoiseModel) -> f64 {
    let output = batch.output(model);
    output
        .iter()
        .zip(&batch.upstream)
        .map(|(o, u)| f64::from(*o) * f64::from(*u))
        .sum()
}

/// Moves one parameter tensor at a time along its own gradient: the loss must grow by the
/// gradient's squared length.
#[test]
fn every_tensors_gradient_predicts_the_loss() {
    // Groups of two channels: normalised one by one, they would not feel the biases before.
    let config = UNetConfig {
        groups: 4,
        ..UNetConfig::new(3, 3, 8, &[1, 2])
    };
    let parameters = parameters(&config, 1);
    let mut engine = engine(&parameters);
    let batch = Batch::new(&config, 3, 32, 2);
    let gradient = batch.gradient(&mut engine);
    for spec in config.layout().entries() {
        let own = &gradient[spec.range()];
        let square: f64 = own.iter().map(|g| f64::from(*g).powi(2)).sum();
        let step = 4e-3 / square.sqrt();
        let mut moved = |sign: f64| {
            let mut values = parameters.values.clone();
            for (value, g) in values[spec.range()].iter_mut().zip(own) {
                *value += (sign * step * f64::from(*g)) as f32;
            }
            engine.set_parameters(&values).expect("finite");
            loss(&batch, &mut engine)
        };
        let difference = (moved(1.0) - moved(-1.0)) / (2.0 * step);
        let error = difference / square - 1.0;
        assert!(
            error.abs() < 0.01,
            "{}: {difference} for {square}",
            spec.name
        );
    }
}
